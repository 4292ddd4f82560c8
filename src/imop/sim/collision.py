"""Does an arm configuration touch anything? Asked of a copy of the model, so the world stays as it is."""

import copy
import itertools
from typing import Any

import mujoco
import numpy as np

from imop.geometry import se3
from imop.sim.world import ROBOT, World
from imop.types import BoolArray, FloatArray, IntArray

CLEARANCE = 0.004
"""Metres kept from everything that is not already nearer at the start or at the goal."""
RESOLUTION = 0.03
"""Largest distance (2-norm, radians) between checked configurations of a motion."""
GOAL_DEPTH = 0.002
"""Metres that a finger or what it holds may press into something at the goal: goals are often contacts."""
_START_SLACK = 0.001


class CollisionChecker:
    """Checks configurations of the arm, with whatever the hand holds, in the scene as it is now.

    Two bodies may not come nearer than `CLEARANCE`; those already nearer at the start or at the goal may not
    touch; those that touch there may not sink deeper into each other.

    Args:
        world: the scene; it is copied.
        allow_collisions: check only the robot against itself.
    """

    def __init__(self, world: World, allow_collisions: bool):
        self.checks = 0
        self._model: Any = copy.copy(world.model)
        self._data: Any = mujoco.MjData(self._model)
        self._data.qpos[:] = world.data.qpos
        self._data.eq_active[:] = 0
        self._arm = world.arm_qpos
        mujoco.mj_kinematics(self._model, self._data)
        self._hand = self._model.body(f"{ROBOT}hand").id
        self._held = _HeldBodies(world, self._model)
        robot = _mask(self._model.nbody, world.robot_bodies)
        self._ignored = _mask(self._model.nbody, world.unavoided)
        held = self._held.members & ~self._ignored
        gripper = [self._model.body(ROBOT + n).id for n in ("hand", "left_finger", "right_finger")]
        self._gripper = _mask(self._model.nbody, gripper)
        self._keep_only_pairs_of(robot | held, others=not allow_collisions, robot=robot)
        self._threshold = np.full((self._model.nbody, self._model.nbody), CLEARANCE)
        self._threshold[np.ix_(held, self._gripper | held)] = -np.inf
        self._threshold[np.ix_(self._gripper, held)] = -np.inf
        self._relax(world.robot_q, np.ones_like(self._threshold, dtype=np.bool_), -np.inf, _START_SLACK)

    def _keep_only_pairs_of(self, moving: BoolArray, others: bool, robot: BoolArray) -> None:
        """Collide moving bodies with all, or the robot with itself only, and never others with others."""
        m = self._model
        bodies = m.geom_bodyid
        solid = ((m.geom_contype != 0) | (m.geom_conaffinity != 0)) & ~self._ignored[bodies]
        active = moving if others else robot
        m.geom_conaffinity[:] = solid & active[bodies]
        m.geom_contype[:] = solid & (active[bodies] | others)
        m.geom_margin[:] = np.where(active[bodies], CLEARANCE, 0.0)
        m.geom_gap[:] = 0.0
        m.body_margin[:] = np.where(active, CLEARANCE, 0.0)  # the compiler's; the broad phase culls by it

    def _near(self, q: FloatArray) -> tuple[IntArray, IntArray, FloatArray]:
        """Pairs of bodies (n,), (n,) nearer than the clearance at `q`, and their distances (n,)."""
        self.checks += 1
        d = self._data
        d.qpos[self._arm] = q
        mujoco.mj_kinematics(self._model, d)
        if self._held.free_qpos:
            T_hand = se3.make(d.xmat[self._hand].reshape(3, 3), d.xpos[self._hand])
            self._held.move(d, T_hand)
            mujoco.mj_kinematics(self._model, d)
        mujoco.mj_collision(self._model, d)
        pairs = self._model.geom_bodyid[d.contact.geom]
        return pairs[:, 0], pairs[:, 1], np.asarray(d.contact.dist)

    def _relax(self, q: FloatArray, where: BoolArray, deepest: float, slack: float) -> None:
        """Allow the distances that the pairs in `where` (bodies, bodies) have at `q`, if not too deep."""
        for a, b, distance in zip(*self._near(q), strict=True):
            if where[a, b] and distance >= deepest:
                allowed = min(self._threshold[a, b], 0.0, distance - slack)
                self._threshold[a, b] = self._threshold[b, a] = allowed

    def expect_goal(self, q_goal: FloatArray) -> None:
        """Let the gripper come as near to other things as it is at the goal; fingers and load may press."""
        pressing = self._held.members | self._gripper
        self._relax(q_goal, pressing[:, None] | pressing[None, :], 0.0, 1e-5)
        pressing[self._hand] = False
        self._relax(q_goal, pressing[:, None] | pressing[None, :], -GOAL_DEPTH, 1e-5)

    def valid(self, q: FloatArray) -> bool:
        """Whether the arm at `q` (J,) keeps its distances."""
        a, b, distance = self._near(q)
        return bool(np.all(distance >= self._threshold[a, b]))

    def valid_motion(self, q: FloatArray) -> bool:
        """Whether all the straight joint motions between successive rows of `q` (n, J) are valid."""
        return all(self.valid(row) for row in densify(q, RESOLUTION))

    def after_search(self) -> "CollisionChecker":
        """The same check with half the clearance, for motions whose coarse check has passed."""
        finer = copy.copy(self)
        half = np.where(self._threshold > 0, self._threshold / 2, self._threshold - _START_SLACK / 2)
        finer._threshold = half
        return finer


class _HeldBodies:
    """Free bodies welded to the hand, which follow it."""

    def __init__(self, world: World, model: Any):
        self.members: BoolArray = np.zeros(model.nbody, dtype=np.bool_)
        self.free_qpos: list[tuple[int, FloatArray]] = []
        T_hand_world = se3.invert(world.pose(f"{ROBOT}hand"))
        for name in world.held:
            body = model.body(name)
            self.members |= model.body_rootid == model.body_rootid[body.id]
            joint = int(body.jntadr[0])
            if joint >= 0 and model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE:
                start = int(model.jnt_qposadr[joint])
                self.free_qpos.append((start, T_hand_world @ world.pose(name)))

    def move(self, data: Any, T_world_hand: FloatArray) -> None:
        """Write the free joints for a pose of the hand."""
        for start, T_hand_body in self.free_qpos:
            T = T_world_hand @ T_hand_body
            data.qpos[start : start + 3] = T[:3, 3]
            mujoco.mju_mat2Quat(data.qpos[start + 3 : start + 7], T[:3, :3].ravel())


def densify(q: FloatArray, resolution: float) -> FloatArray:
    """Rows of `q` (n, J) with rows put between them so that none are farther apart than `resolution`."""
    rows = [q[:1]]
    for a, b in itertools.pairwise(q):
        n = max(1, int(np.ceil(np.linalg.norm(b - a) / resolution)))
        rows.append(a + np.arange(1, n + 1)[:, None] / n * (b - a))
    return np.concatenate(rows)


def _mask(n: int, members: Any) -> BoolArray:
    mask: BoolArray = np.zeros(n, dtype=np.bool_)
    mask[list(members)] = True
    return mask
