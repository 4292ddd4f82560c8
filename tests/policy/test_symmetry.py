"""Turns that change nothing, on boxes and cylinders seen from all sides."""

import numpy as np
import pytest

from imop.geometry import se3
from imop.policy.evidence import Surface
from imop.policy.symmetry import equal_turns, half_turn
from tests.policy.scenes import RED, TABLE, at, box, camera, colored

VIEWS = (camera(),)
CENTER = np.array([0.1, 0.1, TABLE])


def can(radius=0.04, height=0.08, spacing=0.004):
    rng = np.random.default_rng(0)
    count = int(2 * np.pi * radius * height / spacing**2)
    angle = rng.uniform(0, 2 * np.pi, count)
    out = np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1)
    points = radius * out + rng.uniform(0, height, count)[:, None] * [0, 0, 1] + CENTER
    return colored(points, out, RED)


def angles(cloud):
    turns = equal_turns(Surface(cloud, VIEWS), CENTER)
    assert np.array_equal(turns[0], np.eye(4))
    return np.degrees(se3.rotation_distance(turns, np.eye(4))).round()


def test_a_can_looks_the_same_in_every_turn():
    assert len(angles(can())) == 8


def test_a_cube_looks_the_same_in_four_turns():
    assert sorted(angles(box((0.06, 0.06, 0.06), RED, at(0.1, 0.1)))) == [0, 90, 90, 180]


@pytest.mark.parametrize("size", [(0.12, 0.03, 0.04), (0.2, 0.1, 0.02)])
def test_half_a_turn_alone_is_not_trusted(size):
    assert list(angles(box(size, RED, at(0.1, 0.1)))) == [0]


@pytest.mark.parametrize("near", [0.006, 0.012])
@pytest.mark.parametrize("yaw", [0.0, 0.7, 2.0])
def test_a_half_turn_goes_about_the_base_and_not_about_what_sticks_out(yaw, near):
    rng = np.random.default_rng(0)
    base = rng.uniform((-0.03, -0.1, 0), (0.03, 0.1, 0.03), (1500, 3))
    spout = rng.uniform((0.03, -0.01, 0.02), (0.15, 0.01, 0.03), (200, 3))
    T = at(0.2, 0.1, yaw=yaw)
    S = half_turn(se3.apply(T, np.concatenate([base, spout])), near)
    assert se3.rotation_distance(S, np.eye(4)) == pytest.approx(np.pi, abs=0.1)
    middle = T[:3, 3]
    assert np.linalg.norm((se3.apply(S, middle[None])[0] - middle)[:2]) < 0.01


def test_any_thing_has_a_half_turn():
    few = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.02, 0.0]])
    assert se3.rotation_distance(half_turn(few), np.eye(4)) == pytest.approx(np.pi)
