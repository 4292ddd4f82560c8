"""Motions that are made of others: upright ones to a place, and one that is carried on to another place."""

import numpy as np

from imop.geometry import se3
from imop.policy.search import straightened, upright_motions
from tests.policy.scenes import TABLE, at

CENTER = np.array([0.1, 0.1, TABLE])
T = at(0.3, -0.2, yaw=1.2) @ se3.invert(at(0.1, 0.1))
TURNS = 24


def test_upright_motions_take_the_centre_to_every_place():
    places = np.array([[0.3, 0.1, 0.8], [0.0, -0.2, 0.9]])
    motions = upright_motions(CENTER, places, TURNS)
    moved = se3.apply(motions, CENTER[None])[:, 0]
    np.testing.assert_allclose(moved, np.repeat(places, TURNS, axis=0), atol=1e-12)
    np.testing.assert_allclose(motions[:, 2, 2], 1.0)


def test_straightened_goes_to_the_same_place_in_the_other_turn():
    straight = at(0.5, 0.5, 0.1, yaw=0.3)
    moved = straightened(T, straight, CENTER)
    np.testing.assert_allclose(se3.apply(moved, CENTER[None]), se3.apply(T, CENTER[None]))
    np.testing.assert_allclose(moved[:3, :3], straight[:3, :3])
