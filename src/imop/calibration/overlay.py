"""Pictures to look at: where corners were found, and where the calibration puts them."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from imop.calibration.detect import project
from imop.calibration.result import Calibration
from imop.calibration.series import Corners, Series
from imop.extras import extra
from imop.files import replaced
from imop.geometry import se3
from imop.types import ByteArray, FloatArray

FOUND, PREDICTED = (0, 200, 0), (230, 0, 60)
AXES = ((230, 30, 30), (30, 200, 30), (60, 90, 255))
"""Colours of x, y and z."""
AXIS = 0.08
"""Length of the axes drawn, metres."""


def draw_overlay(
    rgb: ByteArray, calibration: Calibration, series: Series, shot: int, camera: str
) -> ByteArray:
    """A picture of a series with what was found in it, and what the calibration says should be there.

    Green circles are the corners that were found, red crosses where the calibration puts them, in the units
    of the original picture. The axes are those of the gripper and of the arm's base: they have to sit on the
    arm.

    Args:
        rgb: (H, W, 3) the picture.
        calibration: where cameras and board are.
        series: with intrinsics as in the calibration.
        shot: number of the shot.
        camera: whose picture it is.
    """
    image = Image.fromarray(rgb)
    pen = ImageDraw.Draw(image)
    known, taken = calibration.cameras[camera], series.shots[shot]
    M = series.motion(camera, taken.T_base_gripper)
    T_camera_board = se3.invert(known.T_mount_camera) @ M @ calibration.T_place_board
    T_base_camera = known.T_mount_camera
    if known.camera.mount == "hand":
        T_base_camera = taken.T_base_gripper @ T_base_camera
    for T, name in ((np.eye(4), "base"), (taken.T_base_gripper, "gripper")):
        _axes(pen, se3.invert(T_base_camera) @ T, calibration, camera, name)
    points = series.board.corners
    predicted = _pixels(T_camera_board, points, calibration, camera)
    for u, v in predicted:
        pen.line((u - 4, v - 4, u + 4, v + 4), PREDICTED, 1)
        pen.line((u - 4, v + 4, u + 4, v - 4), PREDICTED, 1)
    found = taken.corners.get(camera)
    for u, v in found.pixels if found is not None else ():
        pen.ellipse((u - 5, v - 5, u + 5, v + 5), outline=FOUND)
    pen.text(
        (6, 4),
        _caption(taken.name or f"shot {shot}", found, predicted),
        (255, 255, 255),
        stroke_width=2,
        stroke_fill=(0, 0, 0),
    )
    return np.asarray(image)


def save_overlay(pictures: Mapping[str, ByteArray], path: Path) -> None:
    """Write pictures side by side as a PNG."""
    images = [Image.fromarray(picture) for picture in pictures.values()]
    sheet = Image.new("RGB", (sum(i.width for i in images), max(i.height for i in images)))
    left = 0
    for image in images:
        sheet.paste(image, (left, 0))
        left += image.width
    with replaced(path) as temporary:
        sheet.save(temporary, format="PNG")


def _caption(name: str, found: Corners | None, predicted: FloatArray) -> str:
    if found is None:
        return f"{name}: no board found"
    off = np.linalg.norm(predicted[found.ids] - found.pixels, axis=1)
    return f"{name}: {len(found.ids)} corners, {np.median(off):.2f} px off"


def _pixels(T: FloatArray, points: FloatArray, calibration: Calibration, camera: str) -> FloatArray:
    """(N, 2) where the camera's lens, distortion included, puts points (N, 3)."""
    known = calibration.cameras[camera].camera
    assert known.intrinsics is not None
    if not np.any(known.distortion):
        return project(T, points, known.intrinsics)
    with extra("calibrate"):
        import cv2
    turn, _ = cv2.Rodrigues(T[:3, :3])
    pixels, _ = cv2.projectPoints(points, turn, T[:3, 3], known.intrinsics, known.distortion)
    return np.asarray(pixels, dtype=np.float64).reshape(-1, 2)


def _axes(pen: ImageDraw.ImageDraw, T: FloatArray, calibration: Calibration, camera: str, name: str) -> None:
    ends = np.concatenate([np.zeros((1, 3)), AXIS * np.eye(3)])
    if np.any(se3.apply(T, ends)[:, 2] < 0.05):
        return
    pixels = _pixels(T, ends, calibration, camera)
    for (u, v), colour in zip(pixels[1:], AXES, strict=True):
        pen.line((*pixels[0], u, v), colour, 3)
    pen.text(
        (pixels[0][0] + 5, pixels[0][1] + 5), name, (255, 255, 255), stroke_width=2, stroke_fill=(0, 0, 0)
    )
