"""Focal lengths, principal point and distortion of a camera from pictures of the board."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from imop.calibration.board import Board
from imop.calibration.problems import NotCalibrated, Problem
from imop.calibration.series import Corners, RigCamera
from imop.extras import extra
from imop.types import FloatArray

FEW = 5
"""Pictures without which intrinsics are not estimated."""
FOCAL_OFF = 0.1
"""Share by which a focal length has to differ to be called wrong."""
INTRINSICS_REMEDY = (
    "give the intrinsics of this stream and image size (colour, not depth), or none to have them found"
)
SUSPICIOUS = 1.5
"""Pixels (root of the mean square) that corners may lie off in single pictures with the intrinsics given."""


def found_intrinsics(name: str, camera: RigCamera, board: Board, corners: Mapping[int, Corners]) -> RigCamera:
    """The camera with intrinsics and two coefficients of distortion that fit its pictures.

    Raises:
        NotCalibrated: with too few pictures.
        MissingExtra: without OpenCV.
    """
    K, distortion, _ = _estimate(name, camera, board, corners)
    return replace(camera, intrinsics=K, distortion=distortion)


def intrinsics_problem(
    name: str, camera: RigCamera, board: Board, corners: Mapping[int, Corners], rms: float
) -> list[Problem]:
    """Whether other intrinsics explain single pictures much better than the given ones.

    Args:
        name: of the camera.
        camera: with its intrinsics.
        board: what was seen.
        corners: number of the shot -> corners.
        rms: pixels that corners lie off in single pictures with the given intrinsics.
    """
    if rms < SUSPICIOUS or len(corners) < FEW or camera.intrinsics is None:
        return []
    K, _, better = _estimate(name, camera, board, corners)
    if better > rms / 2:
        return []
    given, found = camera.intrinsics[0, 0], K[0, 0]
    problem = (
        f"corners lie {rms:.1f} px off in single pictures with the given intrinsics, {better:.1f} with a "
        f"focal length of {found:.0f} instead of {given:.0f} px"
    )
    return [Problem("intrinsics", "error", f"camera {name}", problem, INTRINSICS_REMEDY)]


def _estimate(
    name: str, camera: RigCamera, board: Board, corners: Mapping[int, Corners]
) -> tuple[FloatArray, FloatArray, float]:
    """Intrinsics (3, 3), distortion (4,), and the root of the mean square of what is left, pixels."""
    with extra("calibrate"):
        import cv2
    if len(corners) < FEW:
        problem = f"no intrinsics are given, and the board was seen in {len(corners)} pictures"
        remedy = f"give the intrinsics that the camera's driver tells, or take {FEW} pictures or more"
        raise NotCalibrated([Problem("few", "error", f"camera {name}", problem, remedy)])
    points = [board.corners[c.ids].astype(np.float32) for c in corners.values()]
    pixels = [c.pixels.astype(np.float32) for c in corners.values()]
    flags = cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST
    start = np.eye(3)
    rms, K, distortion, _, _ = cv2.calibrateCamera(
        points, pixels, (camera.width, camera.height), start, np.zeros(5), flags=flags
    )
    found: FloatArray = np.array(K, dtype=np.float64)
    found[0, 1] = 0.0
    return found, np.asarray(distortion, dtype=np.float64).ravel()[:4], float(rms)
