"""Which scene a method is tried in, and which demonstration it was shown before."""

from dataclasses import dataclass

from imop.errors import ImopError, InvalidInput
from imop.evaluation.splits import chosen_tasks
from imop.tasks.env import ImopEnv, make_env, make_task
from imop.tasks.expert import ExpertFailed, record_demonstration
from imop.tasks.layout import NoRoom
from imop.tasks.suites import find_task
from imop.tasks.task import Task
from imop.types import Demonstration

DEMONSTRATION_SEED = 1_000_000
"""Demonstrations are recorded in scenes of this seed and above, and never tested there."""
_RECORDING_ATTEMPTS = 20


@dataclass(frozen=True)
class Trial:
    """One scene.

    Attributes:
        task: "suite/name".
        seed: of the poses and the clutter.
        variation: of the task.
        instance: seed of shapes, sizes and colours.

    Raises:
        InvalidInput: for a negative seed.
    """

    task: str
    seed: int
    variation: int = 0
    instance: int = 0

    def __post_init__(self) -> None:
        for name in ("seed", "instance"):
            if getattr(self, name) < 0:
                raise InvalidInput(name, f"{getattr(self, name)}", "a whole number from 0 on")

    def env(self) -> ImopEnv:
        """The environment, reset to this scene.

        Raises:
            InvalidInput: for a seed that belongs to demonstrations, or an unknown task or variation.
        """
        if not 0 <= self.seed < DEMONSTRATION_SEED:
            raise InvalidInput("seed", f"{self.seed}", f"0 .. {DEMONSTRATION_SEED - 1}")
        env = make_env(self.task)
        env.reset(seed=self.seed, options={"variation": self.variation, "instance_seed": self.instance})
        return env


def demonstration_for(trial: Trial) -> Demonstration:
    """One demonstration of the trial's task, variation and instance, in a scene that is never tested.

    Raises:
        ExpertFailed: if the expert succeeds in none of the scenes it may choose from.
        NoRoom: if not even a scene was found.
    """
    task = make_task(trial.task)
    for seed in range(DEMONSTRATION_SEED, DEMONSTRATION_SEED + _RECORDING_ATTEMPTS):
        try:
            return record_demonstration(task, seed, trial.variation, trial.instance)
        except (ExpertFailed, NoRoom) as error:
            failure: ImopError = error
    raise failure


def suite_trials(
    suite: str, split: str, tasks: tuple[str, ...], episodes: int, seed: int, instance: int
) -> dict[str, list[Trial]]:
    """`episodes` scenes for each task, by its name within the suite, with the task's variations in turn.

    Raises:
        InvalidInput: for an unknown suite, split or task, no episodes, or seeds of demonstrations.
    """
    if episodes < 1:
        raise InvalidInput("episodes", f"{episodes}", "at least 1")
    if seed + episodes > DEMONSTRATION_SEED:
        problem = f"{episodes} scenes from {seed} on"
        raise InvalidInput("seed", problem, f"scenes below {DEMONSTRATION_SEED}, where demonstrations begin")
    variations = {name: find_task(name).variations for name in chosen_tasks(suite, split, tasks)}
    return {
        name.removeprefix(f"{suite}/"): [Trial(name, seed + i, i % count, instance) for i in range(episodes)]
        for name, count in variations.items()
    }


def most_actions(method: str, demonstration: Demonstration, task: Task) -> int:
    """As many as were demonstrated, or as the task allows to a method that can go back to a step."""
    return task.step_limit if method == "routed" else len(demonstration)
