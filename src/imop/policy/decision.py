"""What the policy decides in a scene, and the demonstrated action, carried over into the scene."""

from dataclasses import dataclass

from imop.geometry import se3
from imop.policy.interfaces import Candidate, Scene, Transition
from imop.policy.router import Option
from imop.types import Action, FloatArray, Match

# The tip is kept this far above the ground, metres, if it was shown above it. What would be deeper in the
# ground than the error of a pose is another motion, and left as it is. Chosen on ring_on_peg, seeds 10 to 19.
CLEARANCE, MISJUDGED = 0.003, 0.02


@dataclass(frozen=True, eq=False)
class Decision:
    """What a policy would do, and its other candidates; nothing is done yet.

    Attributes:
        option: the demonstrated step that is transferred.
        query: the observed scene.
        candidates: where the step's region may be in it, likeliest first.
        action: of one of them, at first of the likeliest.
    """

    option: Option
    query: Scene
    candidates: tuple[Candidate, ...]
    action: Action


def transferred(
    shown: Transition, step: int, region: FloatArray, query: Scene, candidate: Candidate
) -> Action:
    """The demonstrated action, carried over by a candidate: T_j = T_query_support T_i.

    Args:
        shown: the demonstrated step.
        step: its number.
        region: (M, 3) of it.
        query: the observed scene.
        candidate: where the region is in it.
    """
    demonstrated, T = shown.action, se3.orthonormal(candidate.T_query_support)
    match = Match(
        step,
        candidate.p_support,
        candidate.p_query,
        region,
        T,
        candidate.generator,
        candidate.probability,
    )
    return Action(
        above_ground(se3.orthonormal(T @ demonstrated.T_world_gripper), query, shown),
        demonstrated.gripper_open,
        demonstrated.allow_collisions,
        candidate.probability,
        match,
        candidate.reachable,
    )


def above_ground(T_world_gripper: FloatArray, query: Scene, shown: Transition) -> FloatArray:
    """The pose (4, 4), lifted by what it is too near to the ground, if it was shown above the ground."""
    here, there = query.ground.plane, shown.before.ground.plane
    if here is None or there is None:
        return T_world_gripper
    height = float(here.height(T_world_gripper[None, :3, 3])[0])
    height_shown = float(there.height(shown.action.T_world_gripper[None, :3, 3])[0])
    missing = min(height_shown, CLEARANCE) - height
    lifted = T_world_gripper.copy()
    if height_shown > 0 and 0 < missing < MISJUDGED:
        lifted[:3, 3] += missing * here.normal
    return lifted
