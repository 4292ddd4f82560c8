"""Why an episode failed: what went wrong first, the region, the match, the route, the plan or the physics.

The episode is acted again while the simulator is asked where things are; only the evaluation may. Right is
the demonstrated pose, carried over by the true pose of the object or of an equal one, after any turn that
cannot be seen (`equal_poses`); where other things were demonstrated, the expert's pose is right, too. A pose
may be wrong by this measure and do all the same: the first wrong action is where to look first, not always
the culprit.
"""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np

from imop.evaluation.appearance import Appearance
from imop.evaluation.equal_poses import equal_poses
from imop.evaluation.expert_poses import ExpertPoses
from imop.evaluation.methods import make_policy
from imop.evaluation.open_loop import region_shares
from imop.evaluation.picture import Panel
from imop.evaluation.recordings import objects_world
from imop.evaluation.rollout import rollout
from imop.evaluation.steps import Rollout
from imop.evaluation.trials import Trial, most_actions
from imop.geometry import se3
from imop.geometry.accuracy import COARSE, errors
from imop.sim.world import World
from imop.types import Action, Demonstration, FloatArray, Observation


class Cause(StrEnum):
    """What went wrong first.

    Attributes:
        REGION: most of the region of the first wrong action is not on the object that it has to be fixed to.
        MATCH: it is, but the pose is wrong.
        ROUTE: another step was performed than comes next.
        PLAN: all poses were right, and there was no motion to the last of them.
        PHYSICS: all poses were right and reached, and the task was not done.
        OTHER: the policy gave up, or the scene could not be used.
    """

    REGION = "region"
    MATCH = "match"
    ROUTE = "route"
    PLAN = "plan"
    PHYSICS = "physics"
    OTHER = "other"


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """The cause of a failure.

    Attributes:
        cause: the first.
        action: number of the action that it shows in; the last one if none was wrong.
        step: the demonstrated step that this action repeats.
        off: metres and radians from the nearest right pose.
        reason: why the episode ended.
        panel: picture of the action; None if there was none.
    """

    cause: Cause
    action: int
    step: int
    off: tuple[float, float]
    reason: str
    panel: Panel | None


@dataclass(frozen=True, eq=False)
class _Acted:
    step: int
    off: tuple[float, float]
    on_object: float
    panel: Panel

    @property
    def wrong(self) -> bool:
        return not (self.off[0] < COARSE[0] and self.off[1] < np.radians(COARSE[1]))


def diagnose(
    trial: Trial, demonstration: Demonstration, method: str, weights: Path | None = None
) -> Diagnosis | None:
    """Act in a scene and find out what went wrong first; None if nothing did.

    Args:
        trial: the scene.
        demonstration: with its privileged names and poses.
        method: name of the method.
        weights: of the learned policy; None for the bundled ones.

    Raises:
        ImopError: as the scene and the policy do.
    """
    env = trial.env()
    policy = make_policy(method, env.world, weights=weights)
    policy.watch(demonstration if method == "oracle" else demonstration.stripped())
    appearance = Appearance(env.world)
    in_demonstration = Appearance(objects_world(trial.demonstrated)) if trial.other_things else appearance
    expert = ExpertPoses(env.task, env.world, lambda: env.observation, appearance, demonstration)
    acted: list[_Acted] = []

    def on_action(observation: Observation, action: Action) -> None:
        step = action.match.step if action.match else len(acted)
        right = expert(step) if trial.other_things else None
        if right is None:
            right = right_poses(demonstration, step, env.world, appearance)
        expert.took(step, action)
        off = errors(action.T_world_gripper, right)
        keyframe = demonstration.keyframes[step]
        panel = Panel(keyframe, observation, action, f"{trial.task} seed {trial.seed} step {step}")
        acted.append(_Acted(step, off, _on_object(demonstration, action, step, in_demonstration), panel))

    result = rollout(env, policy, most_actions(method, demonstration, trial, env.task), on_action=on_action)
    return None if result.success else _first(acted, result)


def right_poses(demonstration: Demonstration, step: int, world: World, appearance: Appearance) -> FloatArray:
    """(N, 4, 4) T_world_gripper that are right for a demonstrated step in a world as it is now.

    Args:
        demonstration: with names and poses of the objects.
        step: number of the keyframe.
        world: what is acted in.
        appearance: of its objects.
    """
    keyframe = demonstration.keyframes[step]
    shown = equal_poses(demonstration, step, appearance)
    if keyframe.object_name is None or keyframe.T_world_object is None:
        return shown
    name = keyframe.object_name
    used = {k.object_name for k in demonstration.keyframes if k.object_name is not None}
    equal = [other for other in sorted(used) if other == name or appearance.alike(name, other)]
    T_object_world = se3.invert(keyframe.T_world_object)
    return np.concatenate([world.pose(other) @ T_object_world @ shown for other in equal])


def _on_object(demonstration: Demonstration, action: Action, step: int, appearance: Appearance) -> float:
    """Share of the action's region that lies on the object of the demonstrated step; 1 if that is unknown."""
    keyframe = demonstration.keyframes[step]
    if action.match is None or keyframe.object_name is None:
        return 1.0
    shares = region_shares(
        action.match.region, keyframe.observation, appearance.instance(keyframe.object_name)
    )
    return 1.0 if shares is None else shares[0]


def _first(acted: list[_Acted], result: Rollout) -> Diagnosis:
    if not acted or len(acted) > len(result.steps):
        return Diagnosis(Cause.OTHER, len(acted), -1, (np.inf, np.inf), result.reason, None)
    number = next((n for n, action in enumerate(acted) if action.wrong or action.step != n), None)
    if number is None:
        last = acted[-1]
        cause = Cause.PLAN if result.steps[-1].plan_failed else Cause.PHYSICS
        return Diagnosis(cause, len(acted) - 1, last.step, last.off, result.reason, last.panel)
    first = acted[number]
    cause = Cause.REGION if first.on_object < 0.5 else Cause.MATCH
    cause = Cause.ROUTE if first.step != number else cause
    return Diagnosis(cause, number, first.step, first.off, result.reason, first.panel)
