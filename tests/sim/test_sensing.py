"""Cameras with errors: what is seen of one world through different ones."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.sim.cameras import CAMERAS, observe
from imop.sim.depth_noise import DepthNoise
from imop.sim.sensing import Sensing, calibration_error
from imop.sim.world import World, scene_spec
from imop.types import CameraView


@pytest.fixture(scope="module")
def world():
    return World(scene_spec())


@pytest.fixture(scope="module")
def seen(world):
    return observe(world, 2)


def test_without_errors_it_is_what_the_robot_sees(world, seen):
    same = Sensing()(world, 2)
    assert list(same.views) == list(seen.views) and same.time_step == 2
    for name, view in same.views.items():
        assert np.array_equal(view.depth, seen.views[name].depth)
        assert np.array_equal(view.rgb, seen.views[name].rgb)


def test_a_misplaced_camera_sees_the_same_and_says_it_is_elsewhere(seen):
    T = calibration_error(np.random.default_rng(0), 0.003, 0.01)
    told = Sensing(T_camera_told={"front": T}).worsened(seen)
    assert np.array_equal(told.views["front"].depth, seen.views["front"].depth)
    a, b = (o.views["front"].T_world_camera for o in (told, seen))
    assert se3.translation_distance(a, b) == pytest.approx(0.003)
    assert se3.rotation_distance(a, b) == pytest.approx(0.01, abs=1e-6)
    assert told.views["wrist"] is seen.views["wrist"]


def test_errors_have_their_size_in_every_direction():
    errors = [calibration_error(np.random.default_rng(seed), 0.1, 0.2) for seed in range(300)]
    shifts = np.stack([T[:3, 3] for T in errors])
    assert np.allclose(np.linalg.norm(shifts, axis=1), 0.1)
    assert np.all(np.abs(shifts.mean(axis=0)) < 0.02) and np.all(shifts.std(axis=0) > 0.045)


def test_noise_is_another_one_at_every_step_and_the_same_again(seen):
    noisy = Sensing(noise=DepthNoise.of_d415(), seed=(3,))
    a, b, c = (noisy.worsened(replace(seen, time_step=t)).views["front"].depth for t in (0, 1, 0))
    clean = seen.views["front"].depth
    assert np.array_equal(a, c) and not np.array_equal(a, b)
    kept = (a > 0) & (clean > 0)
    assert 0.8 < kept.sum() / (clean > 0).sum() < 1.0
    off = np.abs(a - clean)[kept]
    assert 0.0005 < np.median(off) < 0.02


def test_cameras_that_are_not_there_see_nothing(seen):
    few = Sensing({"front": CAMERAS["front"]})
    assert list(few.worsened(seen).views) == ["front"]
    with pytest.raises(InvalidInput, match="views"):
        Sensing({}).worsened(seen)


@pytest.mark.parametrize("rows", [128, 480])
def test_noise_is_alike_for_images_of_all_sizes(rows):
    slope = np.linspace(1.0, 1.5, rows, dtype=np.float32)[:, None].repeat(rows, axis=1)
    view = CameraView(np.zeros((rows, rows, 3), np.uint8), slope, np.diag([rows, rows, 1.0]), np.eye(4))
    rng = np.random.default_rng(0)
    # No pixel of a slope is at an edge, however steep it is across many pixels.
    assert np.allclose(DepthNoise(bleed=1.0).view(view, rng).depth, slope, atol=1e-5)
    lost = DepthNoise(holes=0.05).view(view, rng).depth == 0
    assert np.mean(lost) == pytest.approx(0.05, abs=0.005)
    _, count = ndimage.label(lost)
    assert 2e-4 < lost.sum() / count / rows**2 < 5e-3
