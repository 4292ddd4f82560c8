"""Which points of a scene are the robot itself, from its joints and its shape."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from imop.errors import InvalidInput
from imop.geometry import primitives, se3
from imop.types import BoolArray, FloatArray, as_array

Distance = Callable[[FloatArray, FloatArray], FloatArray]
"""Signed distances (N,) of points (N, 3) to a shape of some size, in its own frame; see `primitives`."""

TipPose = Callable[[FloatArray], FloatArray]
"""Joint positions (n,) -> T_world_gripper (4, 4)."""

SolidPoses = Callable[[FloatArray, float], FloatArray]
"""Joint positions (n,) and gripper opening, 0 closed .. 1 open -> T_world_solid (S, 4, 4) of all solids."""


@dataclass(frozen=True)
class Solid:
    """One convex shape of a robot.

    Attributes:
        distance: to its surface.
        size: what `distance` takes as its second argument.
        radius: of a sphere about its origin that contains it, metres.
        margin: how far beyond its surface it still removes points, metres.
    """

    distance: Distance
    size: FloatArray
    radius: float
    margin: float


def box(size: FloatArray, margin: float) -> Solid:
    """A box of edges `size` (3,), metres, that removes points up to `margin` (metres) beyond its faces."""
    half = as_array("size", size, (3,)) / 2
    return Solid(primitives.box, half, float(np.linalg.norm(half)), margin)


class SelfFilter:
    """Tells the robot's points from those of the scene by its own geometry at the measured joints.

    Args:
        joints: how many joint positions there are.
        bodies: the solids of each body; those of one body are near each other.
        solid_poses: where all solids are, in the order of `bodies`.
    """

    def __init__(self, joints: int, bodies: Sequence[Sequence[Solid]], solid_poses: SolidPoses):
        self._joints, self._solid_poses = joints, solid_poses
        self._given = bodies
        self._solids = [solid for body in bodies for solid in body]
        self._reach = np.array([solid.radius + solid.margin for solid in self._solids])
        ends = np.cumsum([len(body) for body in bodies])
        self._bodies = [range(end - len(body), end) for end, body in zip(ends, bodies, strict=True)]

    def with_mounted(
        self, solids: Sequence[Solid], T_gripper_solid: FloatArray, tip_pose: TipPose
    ) -> "SelfFilter":
        """The same filter, which knows parts that are mounted on the hand as well, such as a camera.

        Args:
            solids: the parts, see `box`.
            T_gripper_solid: (S, 4, 4), where each is in the frame of the gripper.
            tip_pose: the robot's forward kinematics.
        """
        if not solids:
            return self

        def poses(q: FloatArray, opening: float) -> FloatArray:
            return np.concatenate([self._solid_poses(q, opening), tip_pose(q) @ T_gripper_solid])

        return SelfFilter(self._joints, [*self._given, solids], poses)

    def is_robot(
        self, points: FloatArray, joint_positions: FloatArray, gripper_opening: float = 1.0
    ) -> BoolArray:
        """(N,) True for points on or in the robot.

        Args:
            points: (N, 3) world frame; points that are not finite are not robot.
            joint_positions: (n,) radians.
            gripper_opening: 0 closed .. 1 open.

        Raises:
            InvalidInput: if a shape is wrong, or a joint position or the opening is not finite.
        """
        points = as_array("points", points, (None, 3))
        T = self._posed(joint_positions, gripper_opening)
        # A point this far away is in no solid.
        known = np.nan_to_num(points, nan=1e6, posinf=1e6, neginf=1e6)
        robot = np.zeros(len(points), dtype=bool)
        centres, radii = self._enclosing_spheres(T[:, :3, 3])
        # |p - c|^2 <= r^2 of all pairs in one product.
        beyond = np.einsum("ij,ij->i", known, known) - 2 * centres @ known.T
        reached = beyond <= (radii**2 - (centres**2).sum(axis=1) + 1e-9)[:, None]
        for numbers, inside in zip(self._bodies, reached, strict=True):
            near = np.flatnonzero(inside)
            for number in numbers:
                near = near[~robot[near]]
                solid, T_world_solid = self._solids[number], T[number]
                p_solid = (known[near] - T_world_solid[:3, 3]) @ T_world_solid[:3, :3]
                robot[near] = solid.distance(p_solid, solid.size) <= solid.margin
        return robot

    def distances(
        self, points: FloatArray, joint_positions: FloatArray, gripper_opening: float = 1.0
    ) -> FloatArray:
        """(N,) metres of points (N, 3), world frame, to the robot's surface; negative inside, margins aside.

        Raises:
            InvalidInput: as `is_robot`.
        """
        points = as_array("points", points, (None, 3))
        nearest = np.full(len(points), np.inf)
        for solid, T in zip(self._solids, self._posed(joint_positions, gripper_opening), strict=True):
            # A shape is at least this far away.
            near = np.flatnonzero(se3.lengths(points - T[:3, 3]) - solid.radius < nearest)
            p_solid = (points[near] - T[:3, 3]) @ T[:3, :3]
            nearest[near] = np.minimum(nearest[near], solid.distance(p_solid, solid.size))
        return nearest

    def _posed(self, joint_positions: FloatArray, gripper_opening: float) -> FloatArray:
        q = as_array("joint_positions", joint_positions, (self._joints,))
        if not np.all(np.isfinite(q)):
            raise InvalidInput("joint_positions", "not finite", f"{self._joints} angles in radians")
        if not np.isfinite(gripper_opening):
            raise InvalidInput("gripper_opening", f"{gripper_opening}", "a number, 0 closed .. 1 open")
        return self._solid_poses(q, float(np.clip(gripper_opening, 0, 1)))

    def _enclosing_spheres(self, places: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(B, 3) centres and (B,) radii of spheres around the solids of each body, at `places` (S, 3)."""
        centres = np.stack([places[numbers].mean(axis=0) for numbers in self._bodies])
        radii = [
            (se3.lengths(places[numbers] - centre) + self._reach[numbers]).max()
            for numbers, centre in zip(self._bodies, centres, strict=True)
        ]
        return centres, np.array(radii)
