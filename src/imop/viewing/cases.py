"""What is looked at: a demonstration, the world that it is carried over to, and who decides."""

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from imop.demos.frames import moved
from imop.demos.load import load_demonstration
from imop.errors import CorruptData, InvalidInput
from imop.evaluation.methods import Policy, make_policy
from imop.evaluation.predict import frame_of
from imop.evaluation.robots import PANDA, perception_for
from imop.files import read
from imop.policy.one_shot import OneShotPolicy
from imop.types import Demonstration
from imop.viewing.deciders import ActingDecider, Decider, PolicyDecider
from imop.viewing.worlds import RecordedWorld, World

if TYPE_CHECKING:
    from imop.evaluation.trials import Trial

Base = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Case:
    """What is looked at.

    Attributes:
        demonstration: what is shown.
        world: where it is carried over to.
        method: who decides, as for `make_policy`.
        weights: folder of its weights; by default the bundled ones.
        robot: its name, see `perception_for`.
        steps: so many actions were taken before, if it was recorded.
        recovers: whether a one-shot policy tries again what came to nothing.
    """

    demonstration: Demonstration
    world: World
    method: str = "learned"
    weights: Path | None = None
    robot: str = PANDA
    steps: int = 0
    recovers: bool = False

    def decider(self, policy: Policy | None = None) -> Decider:
        """Who decides, after the demonstration; `policy` instead of the method, if there is one.

        Raises:
            ImopError: as `make_policy` and `watch` do.
        """
        policy = policy or make_policy(self.method, weights=self.weights, robot=self.robot)
        policy.watch(self.demonstration.stripped())
        if isinstance(policy, OneShotPolicy):
            return PolicyDecider(policy, recovers=self.recovers)
        return ActingDecider(policy, self.demonstration, perception_for(self.robot)[0])


def simulated(
    trial: "Trial",
    demo: tuple[Path, int] | None = None,
    method: str = "learned",
    weights: Path | None = None,
) -> Case:
    """A task on the simulator, after a demonstration that is read, or recorded by the expert.

    Args:
        trial: which scene.
        demo: store or folder of RLBench's layout, and number of the episode.
        method: who decides.
        weights: of the method.

    Raises:
        ImopError: if the demonstration or the scene cannot be used.
        MissingExtra: without the extra sim.
    """
    from imop.evaluation.trials import demonstration_for
    from imop.viewing.simulated import SimulatedWorld

    shown = demonstration_for(trial) if demo is None else load_demonstration(*demo)
    return Case(shown, SimulatedWorld(trial), method, weights, trial.robot, recovers=trial.second_try)


def recorded(
    demo: tuple[Path, int],
    scene: tuple[Path, int],
    method: str = "learned",
    weights: Path | None = None,
    base: Base | None = None,
    robot: str = PANDA,
) -> Case:
    """A recorded episode, after another recording as the demonstration.

    Args:
        demo: store or folder of RLBench's layout, and number of the episode.
        scene: likewise.
        method: who decides.
        weights: of the method.
        base: where the robot's base is in both recordings' frame, metres, see `frame_of`.
        robot: its name.

    Raises:
        ImopError: if either recording cannot be used.
    """
    T_imop_world = frame_of(base)
    shown, seen = (moved(load_demonstration(*one), T_imop_world) for one in (demo, scene))
    return Case(shown, RecordedWorld(seen), method, weights, robot, len(seen) - 1)


def from_result(path: Path) -> Case:
    """What `imop run` or `imop predict` did, to be decided again.

    Raises:
        CorruptData: if it is no result.json of theirs, or one of before they said what they were made of.
        ImopError: if what it was made of can no longer be used.
    """
    try:
        result = json.loads(read(path))
        weights = None if result["weights"] is None else Path(result["weights"])
        demo = None if result["demo"] is None else (Path(result["demo"]), int(result["demo_episode"]))
        if "setup" in result:
            problem = "was done by a robot, and what it saw was not kept"
            raise InvalidInput("result", problem, "a result.json of a simulated task or of imop predict")
        if demo is not None and "query" in result:
            query = Path(result["query"]), int(result["query_episode"])
            base = None if result["base"] is None else tuple(result["base"])
            return recorded(demo, query, result["method"], weights, base, result["robot"])
        # Only now, for it needs the extra sim.
        from imop.evaluation.trials import Trial

        trial = Trial(**{field.name: result[field.name] for field in dataclasses.fields(Trial)})
        case = simulated(trial, demo, result["method"], weights)
        return dataclasses.replace(case, steps=len(result["steps"]))
    except InvalidInput:
        raise
    except (ValueError, KeyError, TypeError) as error:
        problem = f"is not what imop run or imop predict writes ({error!r})"
        raise CorruptData(path, problem, "write it again") from error
