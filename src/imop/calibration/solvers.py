"""Closed-form solutions of A_i = inv(X) M_i Y, for a start of the refinement.

A_i = T_camera_board of shot i, M_i the known motion (`Series.motion`), X the camera's pose where it is
mounted and Y the board's where it is. Both ways of mounting a camera are this one equation.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from imop.extras import extra
from imop.geometry import se3
from imop.types import FloatArray, rotation_error

HAND_EYE = ("TSAI", "PARK", "HORAUD", "ANDREFF", "DANIILIDIS")
"""OpenCV's `calibrateHandEye`, which finds X."""
ROBOT_WORLD = ("SHAH", "LI")
"""OpenCV's `calibrateRobotWorldHandEye`, which finds X and Y."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A solution that also asks by how much the robot's lengths differ from the board's.

    Attributes:
        X, Y: (4, 4) poses of camera and board; lengths are the board's.
        scale: lengths of the board per length of the robot; 1 if both are in metres and the board is as said.
        angle: median angle between A_i and inv(X) M_i Y, radians.
        distance: median distance between their origins, metres.
    """

    X: FloatArray
    Y: FloatArray
    scale: float
    angle: float
    distance: float


def starts(A: FloatArray, M: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
    """X and Y (4, 4) by all solvers of OpenCV, for A and M (N, 4, 4), N >= 3; those that fail are left out.

    Raises:
        MissingExtra: without OpenCV.
    """
    with extra("calibrate"):
        import cv2
    for method in HAND_EYE:
        number = getattr(cv2, f"CALIB_HAND_EYE_{method}")
        try:
            R, t = cv2.calibrateHandEye(*_parts(se3.invert(M)), *_parts(A), method=number)
        except cv2.error:
            continue
        X = _pose(R, t)
        if X is not None:
            yield X, mean_pose(se3.invert(M) @ X @ A)
    for method in ROBOT_WORLD:
        number = getattr(cv2, f"CALIB_ROBOT_WORLD_HAND_EYE_{method}")
        try:
            R_YB, t_YB, R_CX, t_CX = cv2.calibrateRobotWorldHandEye(*_parts(A), *_parts(M), method=number)
        except cv2.error:
            continue
        T_camera_mount, T_board_place = _pose(R_CX, t_CX), _pose(R_YB, t_YB)
        if T_camera_mount is not None and T_board_place is not None:
            yield se3.invert(T_camera_mount), se3.invert(T_board_place)


def fit_scaled(A: FloatArray, M: FloatArray) -> Fit:
    """X, Y and the scale of M for A and M (N, 4, 4), N >= 3.

    The rotations are found first, by alternating averages from the Kronecker product's solution (Shah 2013),
    then all lengths by linear least squares.
    """
    R_A, R_M = A[:, :3, :3], M[:, :3, :3]
    R_X, R_Y = _rotations(R_A, R_M)
    # R_X t_A = R_M t_Y + scale t_M - t_X
    n = len(A)
    left = np.zeros((n, 3, 7))
    left[:, :, :3] = R_M
    left[:, :, 3] = M[:, :3, 3]
    left[:, :, 4:] = -np.eye(3)
    right = A[:, :3, 3] @ R_X.T
    solved = np.linalg.lstsq(left.reshape(-1, 7), right.ravel(), rcond=None)[0]
    found: FloatArray = np.asarray(solved, dtype=np.float64)
    off = right - left @ found
    turned = np.swapaxes(R_X @ R_A, -1, -2) @ R_M @ R_Y
    angle = float(np.median(Rotation.from_matrix(turned).magnitude()))
    distance = float(np.median(np.linalg.norm(off, axis=1)))
    return Fit(se3.make(R_X, found[4:]), se3.make(R_Y, found[:3]), float(found[3]), angle, distance)


def mean_pose(T: FloatArray) -> FloatArray:
    """The pose (4, 4) in the middle of poses (N, 4, 4), by the median of positions and the mean rotation."""
    R = Rotation.from_matrix(T[:, :3, :3]).mean().as_matrix()
    return se3.make(R, np.asarray(np.median(T[:, :3, 3], axis=0), dtype=np.float64))


def _rotations(R_A: FloatArray, R_M: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rotations with R_X R_A = R_M R_Y, nearest in the sense of chordal distance."""
    # vec(R_M R_Y R_A^T) = (R_A kron R_M) vec(R_Y): the best pair are singular vectors of the sum.
    K = sum(np.kron(a, m) for a, m in zip(R_A, R_M, strict=True))
    Vh = np.linalg.svd(np.asarray(K))[2]
    R_Y = _nearest_rotation(Vh[0].reshape(3, 3).T)
    for _ in range(5):
        R_X = _nearest_rotation(np.einsum("nij,jk,nlk->il", R_M, R_Y, R_A))
        R_Y = _nearest_rotation(np.einsum("nji,jk,nkl->il", R_M, R_X, R_A))
    return R_X, R_Y


def _nearest_rotation(G: FloatArray) -> FloatArray:
    # The sign of a singular vector is arbitrary, and of -R only the other sign is a rotation.
    G = G if np.linalg.det(G) > 0 else -G
    U, _, Vh = np.linalg.svd(G)
    return np.asarray(U @ np.diag((1.0, 1.0, np.linalg.det(U @ Vh))) @ Vh)


def _parts(T: FloatArray) -> tuple[list[FloatArray], list[FloatArray]]:
    return [m[:3, :3] for m in T], [m[:3, 3:] for m in T]


def _pose(R: Any, t: Any) -> FloatArray | None:
    """The pose of what a solver gave, unless it is none."""
    R, t = np.asarray(R, dtype=np.float64), np.asarray(t, dtype=np.float64).ravel()
    found = np.all(np.isfinite(R)) and rotation_error(R) < 1e-3 and np.linalg.det(R) > 0
    return se3.make(R, t) if found else None
