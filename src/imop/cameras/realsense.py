"""A RealSense camera (D400 series) through pyrealsense2: colour, and depth brought onto its pixels."""

import time
from typing import Any

import numpy as np

from imop.cameras.interfaces import Frame
from imop.errors import InvalidInput
from imop.extras import extra
from imop.types import BoolArray, FloatArray, IntArray

with extra("realsense"):
    import pyrealsense2 as rs

RATE = 30
"""Frames per second."""
TIMEOUT_MS = 2000
"""In which a frame has to come."""
MOST_OLD = 10
"""So many frames may have been taken before they were asked for."""
_UNKNOWN_AGE = 2
"""So many frames are waiting at most, of a camera whose clock cannot be compared with the host's."""


class RealSenseCamera:
    """One camera that is running, as a `Camera`. Stamps are the host's clock.

    Lens distortion is removed by the nearest pixel, if the camera tells of any.

    Args:
        serial: number of the camera, as printed on it.
        size: width and height of colour and depth, pixels.

    Raises:
        MissingExtra: without pyrealsense2.
        ConnectionError: if there is no such camera, or it has no such size.
    """

    def __init__(self, serial: str, size: tuple[int, int]) -> None:
        config = rs.config()
        config.enable_device(serial)
        config.enable_stream(rs.stream.depth, *size, rs.format.z16, RATE)
        config.enable_stream(rs.stream.color, *size, rs.format.rgb8, RATE)
        self._pipeline, self._serial = rs.pipeline(), serial
        try:
            profile = self._pipeline.start(config)
            self._scale = float(profile.get_device().first_depth_sensor().get_depth_scale())
        except RuntimeError as error:
            width, height = size
            raise ConnectionError(f"camera {serial}, {width} x {height}: {error}") from error
        told = profile.get_stream(rs.stream.color).as_video_stream_profile().get_intrinsics()
        self.intrinsics = np.array([[told.fx, 0, told.ppx], [0, told.fy, told.ppy], [0, 0, 1.0]])
        self._source = rectified(told, self.intrinsics)
        self._align = rs.align(rs.stream.color)

    def capture(self) -> Frame:
        """As `Camera.capture`."""
        asked = time.time()
        for number in range(MOST_OLD):
            came, frames = self._pipeline.try_wait_for_frames(TIMEOUT_MS)
            if not came:
                raise ConnectionError(f"camera {self._serial} delivers no frame")
            comparable = frames.get_frame_timestamp_domain() != rs.timestamp_domain.hardware_clock
            stamp = frames.get_timestamp() / 1000 if comparable else time.time()
            if stamp >= asked if comparable else number >= _UNKNOWN_AGE:
                return self._frame(self._align.process(frames), stamp)
        raise ConnectionError(f"camera {self._serial} delivers old frames only: is the host's clock set?")

    def close(self) -> None:
        """End the stream."""
        self._pipeline.stop()

    def _frame(self, frames: Any, stamp: float) -> Frame:
        rgb = np.asarray(frames.get_color_frame().get_data())
        depth = np.asarray(frames.get_depth_frame().get_data()) * np.float32(self._scale)
        if self._source is not None:
            u, v, inside = self._source
            rgb, depth = rgb[v, u], np.where(inside, depth[v, u], 0.0)
        return Frame(rgb, depth.astype(np.float32), self.intrinsics, stamp)


def rectified(told: Any, K: FloatArray) -> tuple[IntArray, IntArray, BoolArray] | None:
    """For each pixel of the image without distortion the nearest one of the image with it.

    Args:
        told: the camera's intrinsics.
        K: (3, 3) of the image without distortion.

    Returns:
        Columns and rows (H, W), and whether they are in the image; None if there is no distortion.

    Raises:
        InvalidInput: for a distortion that maps pixels out of any image.
    """
    if not np.any(np.abs(told.coeffs) > 1e-9):
        return None
    v, u = np.mgrid[: told.height, : told.width]
    rays = np.stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones(u.shape)], axis=-1)
    pixels = [rs.rs2_project_point_to_pixel(told, ray) for ray in rays.reshape(-1, 3).tolist()]
    at = np.array(pixels).reshape(told.height, told.width, 2)
    if not np.all(np.isfinite(at)):
        raise InvalidInput("coeffs", f"{list(told.coeffs)}", "a distortion that this lens can have")
    column, row = np.round(at[..., 0]).astype(np.int32), np.round(at[..., 1]).astype(np.int32)
    inside = (column >= 0) & (column < told.width) & (row >= 0) & (row < told.height)
    return np.where(inside, column, 0), np.where(inside, row, 0), inside
