"""Which scene a method is tried in, and which demonstration it was shown before."""

from dataclasses import dataclass

from rich.table import Table

from imop.errors import ImopError, InvalidInput
from imop.evaluation.oracle import OraclePolicy
from imop.evaluation.rollout import Policy
from imop.geometry.perception import Perception
from imop.policy.baselines import ReplayPolicy
from imop.policy.one_shot import OneShotPolicy
from imop.policy.registration import RegistrationMatcher
from imop.sim.robot import panda_self_filter
from imop.sim.world import World
from imop.tasks.env import ImopEnv, make_env, make_task
from imop.tasks.expert import ExpertFailed, record_demonstration
from imop.tasks.layout import NoRoom
from imop.tasks.tabletop import TABLETOP
from imop.tasks.task import Task
from imop.types import Demonstration

SUITES: dict[str, dict[str, type[Task]]] = {"tabletop": TABLETOP}

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
    """

    task: str
    seed: int
    variation: int = 0
    instance: int = 0

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
    suite: str, tasks: tuple[str, ...], episodes: int, seed: int, instance: int
) -> dict[str, list[Trial]]:
    """`episodes` scenes for each task, with the task's variations in turn.

    Raises:
        InvalidInput: for an unknown suite or task, or no episodes.
    """
    if suite not in SUITES:
        raise InvalidInput("suite", suite, ", ".join(SUITES))
    names = {name.split("/")[1]: (name, task.variations) for name, task in SUITES[suite].items()}
    if unknown := [name for name in tasks if name not in names]:
        raise InvalidInput("tasks", unknown[0], ", ".join(names))
    if episodes < 1:
        raise InvalidInput("episodes", f"{episodes}", "at least 1")
    chosen = {short: names[short] for short in tasks or names}
    return {
        short: [Trial(name, seed + i, i % variations, instance) for i in range(episodes)]
        for short, (name, variations) in chosen.items()
    }


def make_policy(method: str, world: World | None = None, min_confidence: float = 0.0) -> Policy:
    """A fresh policy by the name of its method.

    Args:
        method: replay, registration or oracle.
        world: the simulated world, which only the oracle reads.
        min_confidence: of the one-shot policies.

    Raises:
        InvalidInput: for an unknown method, or an oracle without a world.
    """
    if method == "replay":
        return ReplayPolicy()
    if method == "registration":
        perception = Perception(panda_self_filter().is_robot)
        return OneShotPolicy(RegistrationMatcher(), perception, min_confidence=min_confidence)
    if method == "oracle" and world is not None:
        return OraclePolicy(world)
    raise InvalidInput("method", method, "replay, registration, or (in simulation) oracle")


def tasks_table() -> Table:
    """Suites, tasks, numbers of variations and the instructions of the first variation."""
    table = Table()
    for column in ("task", "variations", "instruction"):
        table.add_column(column)
    for suite in SUITES.values():
        for name, task in suite.items():
            table.add_row(name, str(task.variations), task().instructions(0)[0])
    return table
