"""The RealSense driver on a fake of pyrealsense2."""

import importlib
import sys
import time

import numpy as np
import pytest

from imop.cameras.interfaces import Camera
from tests.cameras.fake_realsense import SCALE, realsense_module

NOW = 1000.0


@pytest.fixture
def realsense(monkeypatch):
    module, state = realsense_module()
    monkeypatch.setitem(sys.modules, "pyrealsense2", module)
    monkeypatch.delitem(sys.modules, "imop.cameras.realsense", raising=False)
    driver = importlib.import_module("imop.cameras.realsense")
    monkeypatch.delitem(sys.modules, "imop.cameras.realsense")
    monkeypatch.setattr(time, "time", lambda: NOW)
    return driver, state


def test_a_frame_has_metres_and_the_streams_intrinsics(realsense):
    driver, state = realsense
    state.stamps = [NOW + 0.01]
    camera: Camera = driver.RealSenseCamera("123", (64, 48))
    frame = camera.capture()
    assert np.allclose(frame.depth, 4000 * SCALE) and frame.depth.dtype == np.float32
    assert np.array_equal(frame.rgb, state.rgb) and frame.stamp == pytest.approx(NOW + 0.01)
    assert np.array_equal(frame.intrinsics, [[60, 0, 31], [0, 61, 24.5], [0, 0, 1]])
    camera.close()
    assert state.stopped


def test_what_was_taken_before_it_was_asked_for_is_passed_over(realsense):
    driver, state = realsense
    state.stamps = [NOW - 0.1, NOW - 0.01, NOW + 0.02, NOW + 0.05]
    assert driver.RealSenseCamera("123", (64, 48)).capture().stamp == pytest.approx(NOW + 0.02)


def test_a_clock_of_its_own_is_not_compared_with_the_hosts(realsense):
    driver, state = realsense
    state.domain, state.stamps = "hardware_clock", [1.0, 1.1, 1.2, 1.3]
    assert driver.RealSenseCamera("123", (64, 48)).capture().stamp == NOW
    assert state.taken == [1.0, 1.1, 1.2]


def test_no_camera_no_frames_and_old_frames_are_connection_errors(realsense):
    driver, state = realsense
    with pytest.raises(ConnectionError, match="124"):
        driver.RealSenseCamera("124", (64, 48))
    camera = driver.RealSenseCamera("123", (64, 48))
    with pytest.raises(ConnectionError, match="no frame"):
        camera.capture()
    state.stamps = [NOW - 5.0] * 20
    with pytest.raises(ConnectionError, match="old"):
        camera.capture()


def test_distortion_is_removed_where_the_camera_tells_of_it(realsense):
    driver, state = realsense
    state.coeffs, state.stamps = [0.2, 0, 0, 0, 0], [NOW + 1] * 2
    straight = driver.RealSenseCamera("123", (64, 48)).capture()
    u, v = 60, 24
    x, y = (u - 31) / 60, (v - 24.5) / 61
    grown = 1 + 0.2 * (x * x + y * y)
    column, row = round(60 * grown * x + 31), round(61 * grown * y + 24.5)
    assert np.array_equal(straight.rgb[v, u], state.rgb[row, column]) and column == 61
    corner = straight.depth[0, 63]
    assert corner == 0 and straight.depth[24, 31] > 0
