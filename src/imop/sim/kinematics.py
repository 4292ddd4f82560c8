"""Inverse kinematics of the Panda: all solutions for one pose, and the continuous branch along a line."""

import frankik
import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from imop.geometry import se3
from imop.robots import panda
from imop.robots.panda import (
    JOINT_LOWER,
    JOINT_UPPER,
    PANDA_HOME_Q,
    T_FLANGE_TIP,
    T_WORLD_BASE,
    link_poses,
)
from imop.types import FloatArray, as_pose

_SAMPLES, _INTERVAL_DEGREES = 120, 330
_FINE_SAMPLES, _WHOLE_RANGE_DEGREES = 12_000, 332
_POSITION_TOLERANCE, _ROTATION_TOLERANCE = 1e-5, 1e-4
_NEWTON_STEPS, _DAMPING = 12, 1e-3


def inverse_kinematics(
    T_world_gripper: FloatArray, q_reference: FloatArray, limit: int | None = None
) -> FloatArray:
    """Arm configurations that put the tip at a pose, nearest to a reference first.

    Args:
        T_world_gripper: (4, 4) pose of the tip.
        q_reference: (7,) radians.
        limit: keep at most so many.

    Returns:
        (n, 7) radians within the joint limits; n = 0 if the pose cannot be reached.
    """
    T = as_pose("T_world_gripper", T_world_gripper)
    # frankik solves for the flange, although its own forward kinematics gives a point of the hand.
    T_base_flange = se3.invert(T_WORLD_BASE) @ T @ se3.invert(T_FLANGE_TIP)
    q = _solutions(T_base_flange, q_reference, _SAMPLES, _INTERVAL_DEGREES)
    if len(q) == 0:
        # At the edge of what the arm reaches, joint 7 has only some tenths of a degree left.
        centred = np.append(q_reference[:6], 0.0)
        q = _solutions(T_base_flange, centred, _FINE_SAMPLES, _WHOLE_RANGE_DEGREES)
    nearest: FloatArray = q[np.argsort(np.linalg.norm(q - q_reference, axis=1), kind="stable")][:limit]
    return nearest


def _solutions(T_base_flange: FloatArray, q_reference: FloatArray, samples: int, interval: int) -> FloatArray:
    """(n, 7) within the joint limits, for so many values of joint 7 in an interval (degrees) around one."""
    found = frankik.ik_sample_q7(
        T_base_flange, q_reference, sample_size=samples, sample_interval=interval, full_ik=True
    )
    rows = np.asarray(found, dtype=np.float64).reshape(-1, 7)
    q: FloatArray = np.unique(np.round(rows, 9), axis=0)
    inside: FloatArray = q[np.all(np.isfinite(q) & (q >= JOINT_LOWER) & (q <= JOINT_UPPER), axis=1)]
    return inside


def reachable(T_world_gripper: FloatArray) -> bool:
    """Whether the arm can put the tip at a pose (4, 4), collisions aside."""
    return len(inverse_kinematics(T_world_gripper, PANDA_HOME_Q, 1)) > 0


class PandaKinematics:
    """The functions of this module as the `Kinematics` of an arm."""

    def tip_pose(self, q: FloatArray) -> FloatArray:
        """T_world_gripper (4, 4) for joints (7,)."""
        return panda.tip_pose(q)

    def inverse(
        self, T_world_gripper: FloatArray, q_reference: FloatArray, limit: int | None = None
    ) -> FloatArray:
        """As `inverse_kinematics`."""
        return inverse_kinematics(T_world_gripper, q_reference, limit)

    def follow(self, poses: FloatArray, q_start: FloatArray) -> FloatArray | None:
        """As `follow`."""
        return follow(poses, q_start)


def line(T_from: FloatArray, T_to: FloatArray, steps: int) -> FloatArray:
    """(steps, 4, 4) poses at fractions 1/steps .. 1 of the way, straight and evenly turning."""
    fractions = np.arange(1, steps + 1)[:, None] / steps
    turn = Rotation.from_matrix(T_from[:3, :3].T @ T_to[:3, :3]).as_rotvec()
    R = T_from[:3, :3] @ Rotation.from_rotvec(fractions * turn).as_matrix()
    return se3.make(R, T_from[:3, 3] + fractions * (T_to[:3, 3] - T_from[:3, 3]))


def follow(poses: FloatArray, q_start: FloatArray) -> FloatArray | None:
    """The continuous branch of solutions that starts at `q_start`.

    Args:
        poses: (n, 4, 4) close-by tip poses, to be reached one after another.
        q_start: (7,) radians, near the first pose.

    Returns:
        (n, 7) radians, or None where the branch leaves the joint limits or ends.
    """
    rows, q = [], q_start
    for T in poses:
        solution = _newton(q, T)
        if solution is None:
            return None
        rows.append(q := solution)
    return np.stack(rows) if rows else np.empty((0, 7))


def _newton(q: FloatArray, T: FloatArray) -> FloatArray | None:
    # MuJoCo's functions: scipy's take longer than all the rest.
    error, quaternion = np.empty(6), np.empty(4)
    for _ in range(_NEWTON_STEPS):
        T_q, J = tip_and_jacobian(q)
        error[:3] = T[:3, 3] - T_q[:3, 3]
        mujoco.mju_mat2Quat(quaternion, (T[:3, :3] @ T_q[:3, :3].T).ravel())
        mujoco.mju_quat2Vel(error[3:], quaternion, 1.0)
        if np.abs(error[:3]).max() < _POSITION_TOLERANCE and np.abs(error[3:]).max() < _ROTATION_TOLERANCE:
            return q
        step: FloatArray = J.T @ np.linalg.solve(J @ J.T + _DAMPING**2 * np.eye(6), error)
        q = np.clip(q + np.clip(step, -0.2, 0.2), JOINT_LOWER, JOINT_UPPER)
    return None


def tip_and_jacobian(q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Tip pose (4, 4) and its Jacobian (6, 7): linear, then angular velocity, world frame."""
    links = link_poses(q)
    T = links[-1] @ T_FLANGE_TIP
    z = links[:7, :3, 2]
    arm = T[:3, 3] - links[:7, :3, 3]
    # np.cross takes longer than all the rest.
    linear = z[:, [1, 2, 0]] * arm[:, [2, 0, 1]] - z[:, [2, 0, 1]] * arm[:, [1, 2, 0]]
    return T, np.concatenate([linear, z], axis=1).T
