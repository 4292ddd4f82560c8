"""What was seen before and is hidden now: the arm stands before much of what it is about to work on."""

import numpy as np

from imop.geometry.cloud import PointCloud, concatenate, project
from imop.geometry.neighbours import within
from imop.geometry.perception import RobotMask
from imop.types import BoolArray, FloatArray, Observation

# A camera that sees this far (metres) behind a point, or nothing before it, would see the point.
BEHIND = 0.02
# What is so near to where the hand has been may have moved, metres.
HANDLED = 0.12
# What is so near to what is seen now is known already, metres.
KNOWN = 0.01


def with_hidden(
    cloud: PointCloud,
    observation: Observation,
    earlier: PointCloud,
    way: FloatArray,
    robot_mask: RobotMask | None,
) -> PointCloud:
    """The cloud of an observation, joined by those points of an earlier one that no camera can see now.

    Args:
        cloud: what is seen now, without normals.
        observation: it is of.
        earlier: what stood in the scene before.
        way: (2, 3) the gripper's tip then and now. What is near to the straight way between them was perhaps
            moved, and is forgotten.
        robot_mask: where the robot is now, nothing else can be.
    """
    points = earlier.points
    kept = hidden(points, observation) & (_from_way(points, way) > HANDLED)
    kept &= ~within(points, cloud.points, KNOWN)
    if robot_mask is not None and observation.joint_positions is not None:
        kept &= ~robot_mask(points, observation.joint_positions, observation.gripper_opening)
    return concatenate([cloud, earlier.select(kept)]) if kept.any() else cloud


def hidden(points: FloatArray, observation: Observation) -> BoolArray:
    """(N,) True for points (N, 3) that no camera sees: something stands before them, or nothing is known."""
    unseen = np.ones(len(points), dtype=bool)
    for view in observation.views.values():
        (column, row), z, inside = (part.T for part in project(view, points))
        depth = view.depth[row, column]
        unseen &= ~(inside & (depth > z - BEHIND))
    return unseen


def _from_way(points: FloatArray, way: FloatArray) -> FloatArray:
    """(N,) metres of points (N, 3) from the straight way between two places (2, 3)."""
    start, step = way[0], way[1] - way[0]
    along = np.clip((points - start) @ step / max(float(step @ step), 1e-12), 0.0, 1.0)
    return np.asarray(np.linalg.norm(points - start - along[:, None] * step, axis=1))
