import numpy as np
import pytest

from imop.geometry import se3
from imop.networks.bearings import BEARINGS, bearings

RNG = np.random.default_rng(0)
POINTS = RNG.uniform(-0.1, 0.1, (80, 3))
NORMALS = se3.rotate(np.eye(4), RNG.normal(size=(80, 3)))
NORMALS /= np.linalg.norm(NORMALS, axis=1, keepdims=True)
THING = RNG.random(80) < 0.8
TRIPLE = 5


def test_moves_on_the_table_change_nothing():
    T = se3.make(se3.euler(z=1.1), (0.3, -0.2, 0.05))
    moved = bearings(se3.apply(T, POINTS), se3.rotate(T, NORMALS), THING)
    np.testing.assert_allclose(moved, bearings(POINTS, NORMALS, THING), atol=1e-4)


def test_a_mirror_turns_the_signs_of_the_triple_products_only():
    here, flip = bearings(POINTS, NORMALS, THING), np.array([1.0, -1.0, 1.0])
    there = bearings(POINTS * flip, NORMALS * flip, THING)
    np.testing.assert_allclose(there[:, :TRIPLE], -here[:, :TRIPLE], atol=1e-5)
    np.testing.assert_allclose(there[:, TRIPLE:], here[:, TRIPLE:], atol=1e-5)
    assert here.shape == (80, BEARINGS) and np.abs(here[:, :TRIPLE]).max() > 0.1


def test_left_and_right_lever_of_a_faucet_are_told_apart():
    along = np.linspace(0, 1, 15)[:, None]
    body = along * (0, 0, 0.1)
    spout = along * (0.12, 0, 0) + (0, 0, 0.1)
    levers = [along * (0, side * 0.1, 0) + (0, side * 0.02, 0.08) for side in (1, -1)]
    points = np.concatenate([body, spout, *levers])
    up = np.tile((0.0, 0.0, 1.0), (len(points), 1))
    found = bearings(points, up, np.ones(len(points), dtype=bool))
    left, right = found[30:45], found[45:]
    assert np.abs(left[7:, 1] - right[7:, 1]).min() > 0.1
    assert left[7:, 1] == pytest.approx(-right[7:, 1], abs=1e-5)


def test_points_that_do_not_count_give_no_bearing():
    far = np.concatenate([POINTS, RNG.uniform(-0.1, 0.05, (20, 3))])
    normals = np.concatenate([NORMALS, np.tile((0.0, 0.0, 1.0), (20, 1))])
    counted = np.concatenate([THING, np.zeros(20, dtype=bool)])
    np.testing.assert_allclose(
        bearings(far, normals, counted)[:80], bearings(POINTS, NORMALS, THING), atol=1e-4
    )
