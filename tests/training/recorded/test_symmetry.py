import numpy as np
import pytest

from imop.geometry import se3
from imop.geometry.perception import Perception
from imop.training.recorded.symmetry import (
    TURNS,
    ColoredPoints,
    ObservedCloud,
    between_turns,
    equal_motions,
    turns_about,
)
from tests.demos.scenes import Box, observe

HOME = se3.make(se3.euler(x=np.pi), (0.28, 0.0, 1.25))
RED, BLUE = (200, 40, 40), (40, 60, 200)
CUBE, SLAB = (0.03, 0.03, 0.03), (0.06, 0.03, 0.03)
SUPPORT, QUERY = (0.30, 0.10, 0.3), (0.22, -0.12, 1.4)


def at(x, y, yaw):
    return se3.make(se3.euler(z=yaw), (x, y, 0.78))


def seen(*boxes):
    """Cloud and observation of boxes (T, half size, colour), with ids from 10."""
    observation = observe(
        [Box(T, half, color, 10 + i) for i, (T, half, color) in enumerate(boxes)], HOME, 1.0
    )
    return Perception()(observation), observation


def motions(half, query_boxes, place=QUERY, others=()):
    """Of a red box at SUPPORT whose action is its own frame; the query shows it at `place`, as box 10."""
    cloud, _ = seen((at(*SUPPORT), half, RED))
    query, observation = seen((at(*place), half, RED), *query_boxes)
    parts = ((c.select(c.ids == 10), T) for c, T in ((cloud, at(*SUPPORT)), (query, at(*place))))
    found = equal_motions(
        ColoredPoints.pooled(parts), ObservedCloud(query, observation), at(*SUPPORT), at(*place), others
    )
    np.testing.assert_allclose(found[0], at(*place) @ se3.invert(at(*SUPPORT)))
    return found @ at(*SUPPORT)


def yaws(poses):
    return np.sort(np.round(np.degrees(np.arctan2(poses[:, 1, 0], poses[:, 0, 0]) - QUERY[2])) % 360)


@pytest.mark.parametrize(("half", "expected"), [(CUBE, [0, 90, 180, 270]), (SLAB, [0, 180])])
def test_turns_that_change_nothing_visible_are_found(half, expected):
    found = motions(half, [])
    np.testing.assert_allclose(found[:, :3, 3], np.tile(at(*QUERY)[:3, 3], (len(expected), 1)), atol=0.003)
    np.testing.assert_allclose(yaws(found), expected, atol=1)


def test_a_mark_breaks_the_symmetry():
    # A knob on one side, part of the object.
    def boxes(place):
        knob = at(*place) @ se3.make(p=(0.045, 0, 0.0))
        return [Box(at(*place), CUBE, RED, 10), Box(knob, (0.015, 0.01, 0.03), RED, 10)]

    looked = [(observe(boxes(place), HOME, 1.0), at(*place)) for place in (SUPPORT, QUERY)]
    parts = [(Perception()(observation), T) for observation, T in looked]
    surface = ColoredPoints.pooled((cloud.select(cloud.ids == 10), T) for cloud, T in parts)
    scene = ObservedCloud(parts[1][0], looked[1][0])
    assert len(equal_motions(surface, scene, at(*SUPPORT), at(*QUERY))) == 1


@pytest.mark.parametrize(
    ("half", "color", "twins"), [(SLAB, RED, 2), (SLAB, BLUE, 0), ((0.04, 0.03, 0.03), RED, 0)]
)
def test_an_equal_thing_elsewhere_is_as_right(half, color, twins):
    place = (0.42, 0.12, -0.5)
    found = motions(SLAB, [(at(*place), half, color)], others=[at(*place), at(0.1, 0.2, 0.0)])
    there = np.linalg.norm(found[:, :3, 3] - at(*place)[:3, 3], axis=1) < 0.005
    assert there.sum() == twins and len(found) == 2 + twins


def test_turns_are_about_the_middle():
    rng = np.random.default_rng(0)
    T = se3.make(se3.euler(0.4, -0.3, 0.2), (0.1, 0.2, 0.3))
    points = rng.uniform(-1, 1, (3000, 3)) * (0.05, 0.03, 0.02)
    # Half of it was hardly seen.
    points = points[(points[:, 0] < 0) | (rng.random(3000) < 0.2)]
    turns = turns_about(se3.apply(T, points), T[:3, 2])
    assert turns.shape == (TURNS, 4, 4)
    np.testing.assert_allclose(turns[0], np.eye(4), atol=1e-12)
    np.testing.assert_allclose(
        se3.apply(turns, T[None, :3, 3])[:, 0], np.tile(T[:3, 3], (TURNS, 1)), atol=0.004
    )
    np.testing.assert_allclose(turns[1] @ turns[TURNS - 1], np.eye(4), atol=1e-9)


def test_between_two_turns_of_what_is_round_everything_is_right():
    axis = np.array([0.1, -0.2, 0.8])
    turns = np.linspace(0.0, 2 * np.pi, TURNS, endpoint=False)
    T = at(*QUERY)

    def about(angles):
        R = np.stack([se3.euler(z=float(angle)) for angle in angles])
        return T @ se3.make(R, axis - R @ axis)

    found = between_turns(about(turns))
    assert len(found) == 72
    # All of them, and nothing else.
    every = about(np.radians(np.arange(0.0, 360.0, 5.0)))
    for one, other in ((found, every), (every, found)):
        assert se3.near(one[:, None], other[None], 1e-6, 1e-5).any(axis=1).all()


@pytest.mark.parametrize("degrees", [[0.0], [0.0, 180.0], [0.0, 90.0, 180.0, 270.0]])
def test_between_turns_that_are_farther_apart_nothing_is_right(degrees):
    motions = np.stack([at(*QUERY) @ se3.make(se3.euler(z=np.radians(angle))) for angle in degrees])
    np.testing.assert_array_equal(between_turns(motions), motions)
