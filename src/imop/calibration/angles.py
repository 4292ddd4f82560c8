"""Rotation vectors whose unit was mistaken: what they would be in the other unit."""

import numpy as np
from scipy.spatial.transform import Rotation

from imop.calibration.series import Series
from imop.calibration.solvers import fit_scaled
from imop.geometry import se3
from imop.types import FloatArray, IntArray

_ROUNDS, _TRIED, _LEAST = 5, 8, 3
_AGREE = np.radians(1.0)


def as_if_radians(T: FloatArray) -> FloatArray:
    """What poses (N, 4, 4) were meant to be if their rotation vectors are radians read as degrees."""
    turns = Rotation.from_matrix(T[:, :3, :3]).as_rotvec()
    return se3.make(Rotation.from_rotvec(np.degrees(turns)).as_matrix(), T[:, :3, 3])


def as_if_degrees(A: FloatArray, T: FloatArray, series: Series, camera: str) -> FloatArray:
    """What poses (N, 4, 4) may have been meant to be if their rotation vectors are degrees read as radians.

    Whole turns are lost by reading, so what was meant is one of some sixty rotations about the same axis.
    Those are taken that turn from shot to shot as the board does before the camera, T_camera_board (N, 4, 4)
    in `A`; they are right only if they fit.
    """
    options = _options(T)
    turned = _angles(A[0], A)
    # For each rotation that the first shot may have: how well the others can be chosen.
    between = _angles(options[0][:, None, None], options[None, 1:])
    off = np.abs(between - turned[None, 1:, None])
    firsts = np.argsort(np.median(off.min(axis=2), axis=1))[:_TRIED]
    found = [_settled(A, T, options, np.append(i, np.argmin(off[i], axis=1)), series, camera) for i in firsts]
    return min(found, key=lambda one: one[0])[1]


def _settled(
    A: FloatArray, T: FloatArray, options: FloatArray, chosen: IntArray, series: Series, camera: str
) -> tuple[float, FloatArray]:
    """Choose again what is nearest to what was seen, some times: median error in radians, and poses."""
    numbers, turned = np.arange(len(T)), _angles(A[:, None], A[None])
    for _ in range(_ROUNDS):
        meant = se3.make(options[numbers, chosen][:, :3, :3], T[:, :3, 3])
        # A wrong choice turns from most others otherwise than the board does.
        agree = np.abs(_angles(meant[:, None], meant[None]) - turned) < _AGREE
        good = np.argsort(-agree.sum(axis=1), kind="stable")[: max(_LEAST, len(T) // 2)]
        M = series.motion(camera, meant)
        fit = fit_scaled(A[good], M[good])
        right = fit.X @ A @ se3.invert(fit.Y)
        right = right if series.board_on == "hand" else se3.invert(right)
        chosen = np.argmin(_angles(right[:, None], options), axis=1).astype(np.int32)
    return fit_scaled(A, M).angle, meant


def _options(T: FloatArray) -> FloatArray:
    """(N, K, 4, 4) rotations that poses (N, 4, 4) may have been meant to have."""
    turns = Rotation.from_matrix(T[:, :3, :3]).as_rotvec()
    angle = np.maximum(np.linalg.norm(turns, axis=1, keepdims=True), 1e-9)
    whole = np.arange(-29, 30) * 2 * np.pi
    meant = np.radians(angle + whole)[..., None] * (turns / angle)[:, None]
    return se3.make(Rotation.from_rotvec(meant.reshape(-1, 3)).as_matrix().reshape(*meant.shape[:2], 3, 3))


def _angles(T_a: FloatArray, T_b: FloatArray) -> FloatArray:
    """Angles (...) between the rotations of poses (..., 4, 4)."""
    trace = np.einsum("...ij,...ij->...", T_a[..., :3, :3], T_b[..., :3, :3])
    return np.asarray(np.arccos(np.clip((trace - 1) / 2, -1, 1)))
