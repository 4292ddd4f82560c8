"""Whether a scene is fit to start from: no overlap, at rest, within reach."""

from collections.abc import Mapping, Sequence

import numpy as np

from imop.errors import PlanFailed
from imop.geometry import se3
from imop.sim.motion import Planner
from imop.sim.world import World
from imop.tasks.waypoint import Waypoint
from imop.types import FloatArray

OVERLAP = 0.001
"""Things at rest sink into each other by less, metres."""
_SETTLE_STEPS = 150
_DRIFT, _TILT, _SPEED = 0.004, 0.05, 0.1
_CANDIDATES = 12


def overlaps(world: World) -> tuple[str, str] | None:
    """Names of two bodies that are inside each other by more than `OVERLAP`, if there are any."""
    for contact in world.data.contact[: world.data.ncon]:
        if contact.dist < -OVERLAP:
            a, b = (world.model.geom_bodyid[g] for g in contact.geom)
            return world.model.body(a).name, world.model.body(b).name
    return None


def settle(world: World) -> None:
    """Let everything come to rest, the arm held where it is."""
    q, opening = world.robot_q, world.gripper_opening
    world.step(_SETTLE_STEPS)
    world.set_robot(q, opening)


def at_rest(world: World, before: Mapping[str, FloatArray]) -> bool:
    """Whether nothing moves now, and the bodies in `before` (name -> T_world_body) are where they were."""
    if np.abs(world.data.qvel).max() > _SPEED:
        return False
    moved = [(T, world.pose(body)) for body, T in before.items()]
    return all(se3.near(a, b, _DRIFT, _TILT) for a, b in moved)


def reachable(world: World, T_world_gripper: FloatArray, allow_collisions: bool) -> bool:
    """Whether some arm configuration reaches the pose, without touching anything unless that is allowed."""
    candidates = world.arm.kinematics.inverse(T_world_gripper, world.arm.home, _CANDIDATES)
    if allow_collisions or len(candidates) == 0:
        return len(candidates) > 0
    state = world.save_state()
    try:
        return any(_is_free(world, q) for q in candidates)
    finally:
        world.restore_state(state)


def _is_free(world: World, q: FloatArray) -> bool:
    world.set_robot(q, 1.0)
    return not touched(world)


def touched(world: World) -> set[str]:
    """Names of the bodies that the robot touches."""
    bodies = world.model.geom_bodyid[world.data.contact.geom[: world.data.ncon]]
    robot = np.isin(bodies, list(world.robot_bodies))
    others = bodies[~robot & robot[:, ::-1]]
    return {world.model.body(i).name for i in others}


def rehearse(world: World, waypoints: Sequence[Waypoint]) -> str:
    """Plan the motions in order, the arm jumping to the end of each, as RLBench validates its scenes.

    Even where collisions are allowed, the open hand may end up touching nothing but the body it works on.

    Args:
        world: left as it is.
        waypoints: the steps, all read in the present state.

    Returns:
        What went wrong, or an empty string.
    """
    state = world.save_state()
    try:
        for waypoint in waypoints:
            target = waypoint.target(world)
            plan = Planner(world).plan(target, waypoint.allow_collisions, waypoint.linear)
            world.set_robot(plan.positions[-1], 1.0)
            if in_the_way := touched(world) - {waypoint.frame}:
                return f"the hand would hit {in_the_way}"
        return ""
    except PlanFailed as error:
        return error.reason
    finally:
        world.restore_state(state)
