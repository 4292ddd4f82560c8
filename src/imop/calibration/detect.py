"""From a picture to the corners of the board in it, and from corners to where the board is."""

from dataclasses import replace

import numpy as np

from imop.calibration.board import Board
from imop.calibration.refine import moved
from imop.calibration.series import Corners
from imop.errors import InvalidInput
from imop.extras import extra
from imop.geometry import se3
from imop.types import ByteArray, FloatArray, as_array

FEW = 8
"""Fewer corners than this are not enough to place a board."""


def detect_corners(board: Board, rgb: ByteArray) -> Corners | None:
    """The board's corners in a picture, to a fraction of a pixel.

    Args:
        board: what is looked for.
        rgb: (H, W, 3) uint8.

    Returns:
        None if fewer than `FEW` corners were found.

    Raises:
        InvalidInput: if `rgb` is no such picture.
        MissingExtra: without OpenCV.
    """
    with extra("calibrate"):
        import cv2
    grey = cv2.cvtColor(as_array("rgb", rgb, (None, None, 3), np.uint8), cv2.COLOR_RGB2GRAY)
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    detector = cv2.aruco.CharucoDetector(board.opencv(), detectorParams=settings)
    pixels, ids, _, _ = detector.detectBoard(grey)
    if ids is None or len(ids) < FEW:
        return None
    return Corners(
        np.asarray(ids, dtype=np.int32).ravel(), np.asarray(pixels, dtype=np.float64).reshape(-1, 2)
    )


def undistorted(corners: Corners, intrinsics: FloatArray, distortion: FloatArray) -> Corners:
    """Where the corners would be in a pinhole camera with the same intrinsics."""
    if not np.any(distortion):
        return corners
    with extra("calibrate"):
        import cv2
    pixels = cv2.undistortPoints(corners.pixels[:, None], intrinsics, distortion, P=intrinsics)
    return replace(corners, pixels=np.asarray(pixels, dtype=np.float64).reshape(-1, 2))


def board_pose(board: Board, corners: Corners, intrinsics: FloatArray) -> FloatArray:
    """T_camera_board (4, 4) that puts the board's corners nearest to where they were seen.

    Of the two poses that show a small board alike, the one with the smaller error in pixels is taken.

    Raises:
        InvalidInput: if the corners lie on a line, or there are fewer than four.
        MissingExtra: without OpenCV.
    """
    with extra("calibrate"):
        import cv2
    points = board.corners[corners.ids]
    if len(points) < 4 or np.linalg.matrix_rank(points[:, :2] - points[:, :2].mean(axis=0), 1e-6) < 2:
        raise InvalidInput(
            "corners", f"{len(points)} corners on a line", "at least four that span a part of the board"
        )
    _, turns, shifts, _ = cv2.solvePnPGeneric(
        points, corners.pixels, intrinsics, None, flags=cv2.SOLVEPNP_IPPE
    )
    poses = []
    for turn, shift in zip(turns, shifts, strict=True):
        turn, shift = cv2.solvePnPRefineLM(points, corners.pixels, intrinsics, None, turn, shift)
        poses.append(moved(np.concatenate([turn, shift], dtype=np.float64).ravel()))
    errors = [np.square(project(T, points, intrinsics) - corners.pixels).sum() for T in poses]
    return poses[int(np.argmin(errors))]


def project(T_camera_points: FloatArray, points: FloatArray, intrinsics: FloatArray) -> FloatArray:
    """(N, 2) pixels of points (N, 3); those behind the camera are put far outside the picture."""
    p = se3.apply(T_camera_points, points)
    z = np.where(p[:, 2] > 1e-6, p[:, 2], 1e-6)
    return np.asarray(p[:, :2] / z[:, None] * intrinsics[[0, 1], [0, 1]] + intrinsics[:2, 2])
