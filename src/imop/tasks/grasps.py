"""Gripper poses in the frame of what is grasped: z approaches, y is the closing direction."""

import numpy as np

from imop.geometry import se3
from imop.types import FloatArray


def from_above(p: tuple[float, float, float] = (0.0, 0.0, 0.0), yaw: float = 0.0) -> FloatArray:
    """T_frame_gripper (4, 4): straight down at `p`, closing along the frame's y axis turned by `yaw`."""
    return se3.make(se3.euler(z=yaw) @ np.diag([-1.0, 1.0, -1.0]), p)


def from_front(p: tuple[float, float, float] = (0.0, 0.0, 0.0), pitch: float = 0.0) -> FloatArray:
    """T_frame_gripper (4, 4): against the frame's x axis and down by `pitch`, closing upright around y."""
    z = np.array([-np.cos(pitch), 0.0, -np.sin(pitch)])
    x = np.array([0.0, 1.0, 0.0])
    return se3.make(np.stack([x, np.cross(z, x), z], axis=1), p)


def backed_off(T_frame_gripper: FloatArray, distance: float) -> FloatArray:
    """The pose `distance` metres before `T_frame_gripper` on its way of approach."""
    return T_frame_gripper @ se3.make(p=(0.0, 0.0, -distance))


def shifted(T_frame_gripper: FloatArray, p: tuple[float, float, float]) -> FloatArray:
    """The pose moved by `p` in the frame of the body."""
    return se3.make(p=p) @ T_frame_gripper


def from_side(p: tuple[float, float, float] = (0.0, 0.0, 0.0), pitch: float = 0.0) -> FloatArray:
    """T_frame_gripper (4, 4): along the frame's x axis and down by `pitch`, closing along its y axis."""
    y, z = np.array([0.0, 1.0, 0.0]), np.array([np.cos(pitch), 0.0, -np.sin(pitch)])
    return se3.make(np.stack([np.cross(y, z), y, z], axis=1), p)
