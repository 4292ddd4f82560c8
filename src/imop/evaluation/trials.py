"""Which scene a method is tried in, and which demonstration it was shown before."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from joblib import Memory

import imop.robots
import imop.sim
import imop.tasks
from imop.baselines.policy import REGRESSORS
from imop.errors import ImopError, InvalidInput
from imop.evaluation.fingerprint import code_digest, own_code_digest
from imop.evaluation.splits import chosen_tasks
from imop.robots import arm_name
from imop.sim.arms import PANDA, find_arm
from imop.sim.cameras import CAMERAS, TWO_CAMERAS
from imop.sim.sensing import Sensing
from imop.tasks.changes import FACTORS, Change, changes_of, read_factors
from imop.tasks.disturbances import can_happen, require_disturbance
from imop.tasks.env import ImopEnv, make_task
from imop.tasks.expert import ExpertFailed, record_demonstration
from imop.tasks.layout import NoRoom
from imop.tasks.suites import find_task
from imop.tasks.task import Task
from imop.types import Demonstration

DEMONSTRATION_SEED = 1_000_000
"""Demonstrations are recorded in scenes of this seed and above, and never tested there."""
_RECORDING_ATTEMPTS = 20
_OTHERS = 10 * DEMONSTRATION_SEED
"""What further demonstrations add to the instance of the first."""


@dataclass(frozen=True)
class Trial:
    """One scene.

    Attributes:
        task: "suite/name".
        seed: of the poses and the clutter.
        variation: of the task.
        instance: seed of shapes, sizes and colours.
        change: names of `tasks.changes.FACTORS`, joined by commas; what the scene differs in.
        shown: that of the demonstration; None if it is the same.
        shown_variation: of the task in the demonstration; None if it is the same.
        disturb: what goes wrong once, see `tasks.disturbances.DISTURBANCES`; nothing if empty.
        second_try: whether the episode goes on after a motion that cannot be planned. It does if disturbed.
        demonstrations: how many are shown, all but the first of other instances that are never tested.
        robot: the arm that acts, and that showed the demonstrations; see `sim.arms.ARMS`.

    Raises:
        InvalidInput: for a negative seed, no demonstration, or an unknown change or disturbance.
    """

    task: str
    seed: int
    variation: int = 0
    instance: int = 0
    change: str = ""
    shown: int | None = None
    shown_variation: int | None = None
    disturb: str = ""
    second_try: bool = False
    demonstrations: int = 1
    robot: str = PANDA.name

    def __post_init__(self) -> None:
        for name in ("seed", "instance", "shown"):
            if (getattr(self, name) or 0) < 0:
                raise InvalidInput(name, f"{getattr(self, name)}", "a whole number from 0 on")
        if self.demonstrations < 1:
            raise InvalidInput("demonstrations", f"{self.demonstrations}", "at least 1")
        object.__setattr__(self, "change", ",".join(read_factors(self.change)))
        object.__setattr__(self, "robot", arm_name(self.robot))
        if self.disturb:
            require_disturbance(self.disturb)
            object.__setattr__(self, "second_try", True)

    @cached_property
    def changed(self) -> Change:
        """What the scene, and what is seen of it, differs in."""
        shown = self.demonstrated
        return Change.of(self.change, self.task, shown.variation, shown.instance, self.seed)

    def make_task(self) -> Task:
        """The task, its things at their size in the scene."""
        return self.changed.of_size(make_task(self.task))

    @property
    def demonstrated(self) -> "Trial":
        """The trial as it would be with the things and the aim of the demonstration."""
        instance = self.instance if self.shown is None else self.shown
        variation = self.variation if self.shown_variation is None else self.shown_variation
        return replace(self, instance=instance, variation=variation, shown=None, shown_variation=None)

    @property
    def other_things(self) -> bool:
        """Whether the scene has other things than the demonstration."""
        shown = self.demonstrated
        return (shown.variation, shown.instance) != (self.variation, self.instance)

    def env(self) -> ImopEnv:
        """The environment, reset to this scene.

        Raises:
            InvalidInput: for a seed that belongs to demonstrations, or an unknown task or variation.
        """
        if not 0 <= self.seed < DEMONSTRATION_SEED:
            raise InvalidInput("seed", f"{self.seed}", f"0 .. {DEMONSTRATION_SEED - 1}")
        env = ImopEnv(
            self.make_task(),
            change=self.changed,
            sense=self.changed.tested,
            disturb=self.disturb,
            second_try=self.second_try,
            arm=find_arm(self.robot),
        )
        env.reset(seed=self.seed, options={"variation": self.variation, "instance_seed": self.instance})
        return env


def demonstration_for(trial: Trial, kept: Path | None = None) -> Demonstration:
    """One demonstration of the trial's task, shown variation and instance, in a scene that is never tested.

    The trial's change of the scene does not apply to it, but that of the set-up does.

    Args:
        trial: the scene in which the task is to be done.
        kept: folder in which recorded demonstrations are kept for the next time, by joblib: a folder of
            one's own, for what lies in it is unpickled.

    Raises:
        ExpertFailed: if the expert succeeds in none of the scenes it may choose from.
        NoRoom: if not even a scene was found.
    """
    return _demonstration(trial, DEMONSTRATION_SEED, trial.demonstrated.instance, kept)


def demonstrations_for(trial: Trial, kept: Path | None = None) -> list[Demonstration]:
    """All that is shown before the trial: that of `demonstration_for`, then those of other instances.

    Raises:
        ExpertFailed, NoRoom: as `demonstration_for`.
    """
    further = range(1, trial.demonstrations)
    first = trial.demonstrated.instance
    # Scenes and instances that no trial has: their seeds are below that of demonstrations.
    return [demonstration_for(trial, kept)] + [
        _demonstration(trial, DEMONSTRATION_SEED + k * _RECORDING_ATTEMPTS, first + _OTHERS + k, kept)
        for k in further
    ]


def _demonstration(trial: Trial, first_seed: int, instance: int, kept: Path | None) -> Demonstration:
    recorded = Memory(kept, verbose=0, compress=1).cache(_recorded)
    variation = trial.demonstrated.variation
    two_cameras = trial.changed.cameras is TWO_CAMERAS
    asked = expert_state(trial.task), trial.task, variation, instance, first_seed, trial.robot, two_cameras
    return _seen(recorded(*asked), trial.changed.shown)


def expert_state(task: str) -> list[str]:
    """Digests of the code that decides what the expert does in a task, and what is seen of it."""
    return [code_digest(imop.sim, imop.robots, imop.tasks), *own_code_digest(find_task(task))]


def _recorded(
    code: list[str],
    name: str,
    variation: int,
    instance: int,
    first_seed: int,
    robot: str,
    two_cameras: bool,
) -> Demonstration:
    """The first demonstration that succeeds; what is kept is that of the same `code`."""
    task, cameras = make_task(name), TWO_CAMERAS if two_cameras else CAMERAS
    for seed in range(first_seed, first_seed + _RECORDING_ATTEMPTS):
        try:
            return record_demonstration(task, seed, variation, instance, arm=find_arm(robot), cameras=cameras)
        except (ExpertFailed, NoRoom) as error:
            failure: ImopError = error
    raise failure


def _seen(demonstration: Demonstration, sensing: Sensing) -> Demonstration:
    """The demonstration as other cameras in the same places would have seen it."""
    steps = (replace(k, observation=sensing.worsened(k.observation)) for k in demonstration.keyframes)
    return replace(demonstration, keyframes=tuple(steps), final=sensing.worsened(demonstration.final))


def suite_trials(
    suite: str,
    split: str,
    tasks: tuple[str, ...],
    episodes: int,
    seed: int,
    instance: int,
    change: str = "",
    other: bool = False,
) -> dict[str, list[Trial]]:
    """`episodes` scenes for each task, by its name within the suite, with the task's variations in turn.

    If `other`, every scene shows another instance of the things than the demonstration, which shows
    `instance`. Of a change every task gets the factors that it has; tasks that have none are left out.

    Raises:
        InvalidInput: for an unknown suite, split, task or change, a change that none of the tasks has, other
            instances where a task has one, no episodes, or seeds of demonstrations.
    """
    if episodes < 1:
        raise InvalidInput("episodes", f"{episodes}", "at least 1")
    if seed + episodes > DEMONSTRATION_SEED:
        problem = f"{episodes} scenes from {seed} on"
        raise InvalidInput("seed", problem, f"scenes below {DEMONSTRATION_SEED}, where demonstrations begin")
    kinds = {name: find_task(name) for name in chosen_tasks(suite, split, tasks)}
    if other:
        for name in kinds:
            require_instances(name, "instances", "other", "same")
    changes = changes_of(kinds, change)
    return {
        name.removeprefix(f"{suite}/"): [
            Trial(
                name,
                seed + i,
                i % kind.variations,
                instance + other * (1 + seed + i),
                ",".join(changes[name]),
                instance if other else None,
            )
            for i in range(episodes)
        ]
        for name, kind in kinds.items()
        if changes[name] or not change
    }


def disturbed(trials: Mapping[str, Sequence[Trial]], disturb: str) -> dict[str, list[Trial]]:
    """The same scenes, disturbed; tasks in which that cannot happen are left out.

    Raises:
        InvalidInput: for an unknown disturbance, or one that can happen in none of the tasks.
    """
    found = {
        task: [replace(trial, disturb=disturb) for trial in of_task]
        for task, of_task in trials.items()
        if _can_happen(disturb, of_task[0])
    }
    if not found:
        raise InvalidInput("disturb", f"{disturb} of {', '.join(trials)}", "a task in which that can happen")
    return found


def _can_happen(disturb: str, trial: Trial) -> bool:
    require_disturbance(disturb)
    try:
        env = trial.env()
    except NoRoom:
        return True  # another scene of the task will tell
    return can_happen(disturb, env.task, env.world)


def require_instances(task: str, field: str, value: str, accepted: str) -> None:
    """Refuse a value that asks for another instance of the things of a task.

    Raises:
        InvalidInput: if the task has one instance only, or there is no such task.
    """
    if find_task(task).one_instance:
        raise InvalidInput(field, f"{value}, but {task} has one instance of its things", accepted)


def change_notes(trials: Mapping[str, Sequence[Trial]], change: str) -> list[str]:
    """What a change means, and which tasks of `suite_trials` do not have all of its factors."""
    wanted = read_factors(change)
    lacking = {
        factor: [task for task, (trial, *_) in trials.items() if factor not in trial.changed.factors]
        for factor in wanted
    }
    without = [
        f"{factor} was not changed in {', '.join(tasks)}." for factor, tasks in lacking.items() if tasks
    ]
    return [*(f"{factor}: {FACTORS[factor]}" for factor in wanted), *without]


def most_actions(method: str, demonstration: Demonstration, trial: Trial, task: Task) -> int:
    """As many as were demonstrated, or as the task allows to those who may try again or follow no order."""
    free = trial.second_try or method in ("learned", "paper", *REGRESSORS)
    return task.step_limit if free else len(demonstration)
