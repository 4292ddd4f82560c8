"""Turns about the vertical: which ones leave a thing as it is."""

import numpy as np
import pytest

from imop.geometry import se3
from imop.geometry.turns import axis_of_round, equal_turns, half_turn, onto, peak, upright_motions
from tests.policy.scenes import RED, TABLE, at, box, marked_can

HERE = at(0.1, 0.1)
CENTER = np.array([0.1, 0.1, TABLE])
TURNS = 24


def test_upright_motions_take_the_centre_to_every_place():
    places = np.array([[0.3, 0.1, 0.8], [0.0, -0.2, 0.9]])
    motions = upright_motions(CENTER, places, TURNS)
    moved = se3.apply(motions, CENTER[None])[:, 0]
    np.testing.assert_allclose(moved, np.repeat(places, TURNS, axis=0), atol=1e-12)
    np.testing.assert_allclose(motions[:, 2, 2], 1.0)


def angles(cloud):
    turns = equal_turns(cloud.points)
    assert np.array_equal(turns[0], np.eye(4))
    return np.degrees(se3.rotation_distance(turns, np.eye(4))).round()


def test_a_can_looks_the_same_in_every_turn():
    assert len(angles(marked_can(0.0, HERE))) == 8


@pytest.mark.parametrize("seen", [slice(None), [0, 1, 7], [0, 3, 4, 5]])
def test_every_turn_about_the_axis_of_a_can_leaves_it_where_it_is(seen):
    """Of what was seen from one side, some turns show the side that was not."""
    cloud = marked_can(0.0, HERE)
    axis = axis_of_round(equal_turns(cloud.points)[seen])
    turns = upright_motions(axis, axis[None], TURNS)
    assert onto(cloud.points[::5], cloud.points, turns).min() > 0.8
    away = np.degrees(se3.rotation_distance(turns, np.eye(4))).round()
    assert sorted(away) == sorted(min(15.0 * k, 360.0 - 15.0 * k) for k in range(TURNS))


@pytest.mark.parametrize("size", [(0.06, 0.06, 0.06), (0.12, 0.03, 0.04)])
def test_a_box_is_not_round(size):
    assert axis_of_round(equal_turns(box(size, RED, HERE).points)) is None


def test_a_cube_looks_the_same_in_four_turns():
    assert sorted(angles(box((0.06, 0.06, 0.06), RED, HERE))) == [0, 90, 90, 180]


@pytest.mark.parametrize("size", [(0.12, 0.03, 0.04), (0.2, 0.1, 0.02)])
def test_half_a_turn_alone_is_not_trusted(size):
    assert list(angles(box(size, RED, HERE))) == [0]


@pytest.mark.parametrize("yaw", [0.0, 0.7, 2.0])
def test_a_half_turn_goes_about_the_base_and_not_about_what_sticks_out(yaw):
    rng = np.random.default_rng(0)
    base = rng.uniform((-0.03, -0.1, 0), (0.03, 0.1, 0.03), (1500, 3))
    spout = rng.uniform((0.03, -0.01, 0.02), (0.15, 0.01, 0.03), (200, 3))
    T = at(0.2, 0.1, yaw=yaw)
    S = half_turn(se3.apply(T, np.concatenate([base, spout])))
    assert se3.rotation_distance(S, np.eye(4)) == pytest.approx(np.pi, abs=0.1)
    middle = T[:3, 3]
    assert np.linalg.norm((se3.apply(S, middle[None])[0] - middle)[:2]) < 0.01


def test_any_thing_has_a_half_turn():
    few = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.02, 0.0]])
    assert se3.rotation_distance(half_turn(few), np.eye(4)) == pytest.approx(np.pi)


@pytest.mark.parametrize("top", [-0.31, 0.0, 0.2])
def test_the_peak_of_a_parabola_is_found_between_the_angles(top):
    angles = np.arange(-4, 5) * 0.1
    assert peak(angles, 3.0 - 2.0 * (angles - top) ** 2) == pytest.approx(top)


def test_the_peak_is_one_of_the_angles_if_there_is_none_between():
    angles = np.arange(-4, 5) * 0.1
    assert peak(angles, angles**2 + angles) == angles[-1]
    assert peak(angles, -((angles - 2.0) ** 2)) == angles[-1]
