"""What may go wrong in an episode through no fault of the policy: once, something is moved or pushed back.

Which thing it is the disturber reads from the simulation and the expert's waypoints. No policy knows of it.
"""

import zlib
from collections.abc import Collection, Iterator, Sequence
from itertools import pairwise

import mujoco
import numpy as np

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.sim.gripper import OnFrame, release
from imop.sim.world import World
from imop.tasks.checks import reachable
from imop.tasks.clear import GROUND, geoms_of, is_clear
from imop.tasks.layout import Area, NoRoom
from imop.tasks.task import Task
from imop.tasks.waypoint import Waypoint
from imop.types import FloatArray

DISTURBANCES: dict[str, str] = {
    "moved": "After the first approach, what is about to be acted on is moved by 10 cm.",
    "knocked": "What is taken first is knocked out of the hand and stands 10 cm beside.",
    "missed": "What is taken first slips 3 to 7 cm aside as the fingers close on nothing.",
    "shut": "What was opened, shut or turned first is pushed back to where it was.",
}
"""What may happen, once in an episode -> what that means."""

_REACH = {"moved": (0.1, 0.1), "knocked": (0.1, 0.12), "missed": (0.03, 0.07)}
_MOVED = {int(mujoco.mjtJoint.mjJNT_SLIDE): 0.03, int(mujoco.mjtJoint.mjJNT_HINGE): 0.3}
"""A joint that went this far was opened, metres or radians."""
_TABLE = Area((-0.1, 0.55), (-0.42, 0.42))
_CLEARANCE, _DEPTH, _STAYS = 0.005, 0.003, (0.004, 0.05)
_TRIES, _SETTLE_STEPS, _FAR = 60, 200, 1.0


class Disturber:
    """Disturbs one episode once.

    Args:
        kind: name of one of `DISTURBANCES`.
        task: of the scene.
        world: the scene at the beginning.
        seed: decides where things go.

    Raises:
        InvalidInput: for an unknown kind.
    """

    def __init__(self, kind: str, task: Task, world: World, seed: int):
        require_disturbance(kind)
        self._kind, self._task, self._happened = kind, task, False
        self._rng = np.random.default_rng((zlib.crc32(kind.encode()), seed))
        self._waypoints = task.waypoints(world)
        self._joints = _openable(world)
        self._actions = 0

    def after_action(self, world: World, on_frame: OnFrame) -> bool:
        """Disturb the world if it is time, after an action was carried out; whether that was so.

        Args:
            world: changed in place.
            on_frame: called with the world once it is disturbed.

        Raises:
            NoRoom: if what is moved finds no place.
        """
        self._actions += 1
        if self._happened:
            return False
        if self._kind == "shut":
            self._happened = self._shut(world)
        elif self._kind == "moved":
            approach = _closing(self._waypoints)
            if self._actions == approach:
                frame = world.model.body(self._waypoints[approach].frame).id
                self._happened = self._put_aside(world, _touching(world, _uppermost(world, frame)))
        elif held := [world.model.body(name).id for name in world.held if _is_free(world, name)]:
            release(world)
            self._happened = self._put_aside(world, {_uppermost(world, held[0])})
        if self._happened:
            on_frame(world)
        return self._happened

    def _put_aside(self, world: World, things: Collection[int]) -> bool:
        """Put things, by their uppermost bodies, where nothing else is."""
        m, before = world.model, world.save_state()
        whole = [i for i in range(m.nbody) if m.body_rootid[i] in things]
        own, others = geoms_of(world, whole)
        names = [m.body(i).name for i in sorted(things)]
        poses = {name: world.pose(name) for name in names}
        for _ in range(_TRIES):
            world.restore_state(before)
            shift = _aside(self._rng, *_REACH[self._kind])
            if not all(_on_table(T[:3, 3], shift) for T in poses.values()):
                continue
            there = _shifted(world, poses, shift)
            there = _shifted(world, there, np.array([0, 0, -_above_table(world, own)]))
            if not is_clear(world, own, others, _CLEARANCE):
                continue
            world.step(_SETTLE_STEPS)
            stays = all(se3.near(world.pose(name), T, *_STAYS) for name, T in there.items())
            if stays and self._within_reach(world, whole):
                return True
        raise NoRoom(f"{names[0]}: no free place beside in {_TRIES} tries")

    def _within_reach(self, world: World, bodies: Collection[int]) -> bool:
        """Whether the expert could take what was moved."""
        approach = _closing(self._waypoints) - 1
        steps = [w for w in self._task.waypoints(world)[approach:] if world.model.body(w.frame).id in bodies]
        return all(reachable(world, w.target(world), w.allow_collisions or self._task.insist) for w in steps)

    def _shut(self, world: World) -> bool:
        """Push the first joint back that was moved; whether there was one."""
        for joint, start in self._joints.items():
            now, far = world.joint(joint), _MOVED[int(world.model.joint(joint).type[0])]
            if abs(now - start) > far:
                release(world)
                for share in (0.0, 0.25, 0.5):
                    world.set_joint(joint, start + share * (now - start))
                    if not _hits_robot(world):
                        break
                world.step(_SETTLE_STEPS)
                return True
        return False


def require_disturbance(kind: str) -> None:
    """Refuse what is none of `DISTURBANCES`.

    Raises:
        InvalidInput: for another name.
    """
    if kind not in DISTURBANCES:
        raise InvalidInput("disturb", kind, f"one of {', '.join(DISTURBANCES)}")


def can_happen(kind: str, task: Task, world: World) -> bool:
    """Whether a task's scene has what a disturbance needs.

    Raises:
        InvalidInput: for an unknown kind.
    """
    require_disturbance(kind)
    m, waypoints = world.model, task.waypoints(world)
    closing = _closing(waypoints)
    if kind == "shut":
        roots = {int(m.body_rootid[m.body(w.frame).id]) for w in waypoints}
        return any(int(m.body_rootid[m.joint(j).bodyid[0]]) in roots for j in _openable(world))
    frame = waypoints[min(closing, len(waypoints) - 1)].frame
    if kind == "moved":
        first = _uppermost(world, m.body(frame).id)
        return bool(m.body_jntnum[first] == 0) or _is_free(world, m.body(first).name)
    grasps = [b.frame for a, b in pairwise(waypoints) if a.gripper_open and not b.gripper_open]
    return any(frame in world.graspable and _is_free(world, frame) for frame in grasps)


def _closing(waypoints: Sequence[Waypoint]) -> int:
    """The first step that acts after an approach: that closes the gripper, or the second if none does."""
    closing = (k for k, w in enumerate(waypoints) if k > 0 and not w.gripper_open)
    return next(closing, 1)


def _uppermost(world: World, body: int) -> int:
    return int(world.model.body_rootid[body])


def _is_free(world: World, body: str) -> bool:
    m, number = world.model, world.model.body(body).id
    first = int(m.body_jntadr[number])
    return bool(m.body_jntnum[number] == 1 and m.jnt_type[first] == mujoco.mjtJoint.mjJNT_FREE)


def _openable(world: World) -> dict[str, float]:
    """Hinges and slides of things that nothing drives back, and where they are now."""
    m = world.model
    solid = m.geom_bodyid[(m.geom_contype != 0) | (m.geom_conaffinity != 0)].tolist()
    bearing = {carrier for body in set(solid) for carrier in _carriers(world, body)} - world.robot_bodies
    joints = [
        m.joint(j).name
        for j in range(m.njnt)
        if int(m.jnt_type[j]) in _MOVED and m.jnt_stiffness[j] == 0 and int(m.jnt_bodyid[j]) in bearing
    ]
    return {name: world.joint(name) for name in joints}


def _carriers(world: World, body: int) -> Iterator[int]:
    """A body, what carries it, and so on."""
    while body:
        yield body
        body = int(world.model.body_parentid[body])


def _touching(world: World, thing: int) -> set[int]:
    """The uppermost bodies of a thing and of all that touches it, directly or through others."""
    m, d = world.model, world.data
    ground = {int(m.body(name).id) for name in GROUND} | {0, _uppermost(world, min(world.robot_bodies))}
    pairs = m.body_rootid[m.geom_bodyid[d.contact.geom[: d.ncon]]].tolist()
    found, grows = {thing}, True
    while grows:
        more = {other for a, b in pairs for one, other in ((a, b), (b, a)) if one in found} - ground - found
        found, grows = found | more, bool(more)
    return found


def _aside(rng: np.random.Generator, near: float, far: float) -> FloatArray:
    """(3,) a way along the table, metres."""
    angle, length = rng.uniform(-np.pi, np.pi), rng.uniform(near, far)
    return np.array([length * np.cos(angle), length * np.sin(angle), 0.0])


def _on_table(p: FloatArray, shift: FloatArray) -> bool:
    x, y, _ = p + shift
    return bool(_TABLE.x[0] < x < _TABLE.x[1] and _TABLE.y[0] < y < _TABLE.y[1])


def _shifted(world: World, poses: dict[str, FloatArray], shift: FloatArray) -> dict[str, FloatArray]:
    """Shift bodies from their poses, and say where they are then."""
    there = {name: se3.make(p=shift) @ T for name, T in poses.items()}
    for name, T in there.items():
        world.set_free_pose(name, T)
    return there


def _above_table(world: World, geoms: Collection[int]) -> float:
    """Metres between the table and the lowest of some geometries."""
    m = world.model
    top = np.flatnonzero(m.geom_bodyid == m.body("table").id)
    solid = [g for g in geoms if m.geom_contype[g] or m.geom_conaffinity[g]]
    pairs = ((int(g), int(t)) for g in solid for t in top)
    distances = (mujoco.mj_geomDistance(m, world.data, *pair, _FAR, None) for pair in pairs)
    return float(max(min(distances, default=0.0), 0.0))


def _hits_robot(world: World) -> bool:
    bodies = world.model.geom_bodyid[world.data.contact.geom[: world.data.ncon]]
    robot = np.isin(bodies, list(world.robot_bodies))
    return bool(np.any((robot[:, 0] != robot[:, 1]) & (world.data.contact.dist[: world.data.ncon] < -_DEPTH)))
