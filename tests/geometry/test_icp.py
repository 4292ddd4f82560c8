"""Closest points and upright motions."""

import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.geometry.icp import Refiner, upright
from tests.policy.scenes import RED, at, box


def test_a_near_guess_becomes_exact():
    thing, again = (box((0.08, 0.05, 0.06), RED, seed=seed).points for seed in (0, 1))
    truth = at(0.2, 0.1, 0.75, yaw=0.7)
    guess = truth @ se3.make(se3.euler(0.05, -0.05, 0.15), (0.008, -0.006, 0.005))
    found = Refiner(se3.apply(truth, again))(thing, guess)
    assert se3.translation_distance(found, truth) < 1e-3
    assert se3.rotation_distance(found, truth) < 0.02


def test_what_is_out_of_reach_stays():
    thing = box((0.08, 0.05, 0.06), RED).points
    far = se3.make(p=(5.0, 0, 0))
    np.testing.assert_allclose(Refiner(thing)(thing, far), far)


def test_too_few_points_are_refused():
    with pytest.raises(InvalidInput):
        Refiner(np.zeros((4, 3)))


@pytest.mark.parametrize("yaw", [-3.0, -0.4, 0.0, 1.6, 3.1])
def test_upright_keeps_turn_and_place_and_removes_tilt(yaw, rng):
    center = np.array([0.3, -0.2, 0.8])
    T = at(0.1, 0.2, 0.3, yaw) @ se3.make(se3.euler(x=0.1, y=-0.05))
    flat = upright(T, center)
    np.testing.assert_allclose(flat[2, :3], (0, 0, 1), atol=1e-12)
    np.testing.assert_allclose(se3.apply(flat, center[None]), se3.apply(T, center[None]), atol=1e-12)
    assert np.isclose(np.exp(1j * yaw), np.exp(1j * np.arctan2(flat[1, 0], flat[0, 0])), atol=0.02)


def test_normals_stand_on_the_faces_of_a_box():
    thing = box((0.08, 0.05, 0.06), RED)
    upright_to = np.abs(np.einsum("ij,ij->i", Refiner(thing.points).normals, thing.normals))
    assert np.quantile(upright_to, 0.3) > 0.99
