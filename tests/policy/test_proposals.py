"""What is proposed: what matches agree on, upright and straightened motions, and turns by paint."""

import numpy as np
import pytest

from imop.geometry import se3
from imop.geometry.cloud import concatenate, middle
from imop.policy.evidence import Template
from imop.policy.interfaces import PolicyConfig
from imop.policy.proposals import Matches, Turns, straightened
from imop.policy.region import Region
from imop.policy.target import Surface, Target
from tests.policy.scenes import BLUE, RED, TABLE, above, at, box, marked_can, scene

SIZE = (0.1, 0.05, 0.06)
HERE, THERE = at(0.1, 0.1), at(0.3, -0.2, yaw=1.2)
T = THERE @ se3.invert(HERE)
CENTER = np.array([0.1, 0.1, TABLE])


@pytest.fixture
def matches():
    cloud = box(SIZE, RED, HERE).select(np.arange(0, 600, 5))
    wrong = np.arange(len(cloud)) % 4 == 0
    y = np.where(wrong[:, None], np.roll(cloud.points, 7, axis=0) + 0.2, se3.apply(T, cloud.points))
    return Matches(cloud.points, cloud.normals, y, se3.rotate(T, cloud.normals), np.ones(len(cloud)))


def test_three_quarters_agree_on_the_right_motion(matches):
    np.testing.assert_allclose(matches.agreement(np.stack([T, np.eye(4)]), 0.015), (0.75, 0.0), atol=0.01)


def test_triples_find_the_motion_although_some_matches_are_wrong(matches):
    best = matches.motions(4000)[0]
    assert se3.translation_distance(best @ HERE, THERE) < 1e-3


def test_part_of_the_region_has_its_own_matches(matches):
    few = matches.x[:10]
    part = matches.of(few)
    assert len(part.x) >= 10 and len(part.x) < len(matches.x)
    assert np.linalg.norm(part.x[:, None] - few[None], axis=-1).min(axis=1).max() < 0.02


def test_upright_motions_go_to_the_thing_that_was_matched(matches):
    cloud = concatenate([box(SIZE, RED, THERE), box(SIZE, BLUE, at(0.0, -0.3))])
    target = Target(scene([], above(0, 0, 1.2)), cloud)
    p = middle(matches.x)
    turned = matches.upright(target, 1, 24, [p])
    # First the mean of the matches, wrong ones included, then the middle of the thing.
    moved = se3.apply(turned[24:], p[None])[:, 0]
    assert np.linalg.norm(moved[:, :2] - THERE[:2, 3], axis=1).max() < 0.01
    assert se3.rotation_distance(turned, np.tile(T, (len(turned), 1, 1))).min() < np.radians(7.6)


def test_without_matches_nothing_is_proposed(matches):
    none = matches.of(matches.x + 10.0)
    target = Target(scene([], above(0, 0, 1.2)), box(SIZE, RED, THERE))
    assert len(none.motions(4000)) == 0
    assert len(none.upright(target, 1, 24, [middle(matches.x)])) == 0


def test_straightened_goes_to_the_same_place_in_the_other_turn():
    straight = at(0.5, 0.5, 0.1, yaw=0.3)
    moved = straightened(T, straight, CENTER)
    np.testing.assert_allclose(se3.apply(moved, CENTER[None]), se3.apply(T, CENTER[None]))
    np.testing.assert_allclose(moved[:3, :3], straight[:3, :3])


def turns(shown, seen, axis=HERE[:3, 3]):
    """Which turn of `shown` is meant in a scene of `seen`."""
    region = Region(shown, np.ones(len(shown)), np.zeros((0, 3)), spread=np.full(len(shown), 0.001))
    template = Template(region, HERE[:3, 3], shown, (), PolicyConfig())
    return Turns(template, Surface(seen, ()), axis, about(np.pi), PolicyConfig())


def about(angle):
    """The turn about the axis of what stands at HERE."""
    return HERE @ se3.make(se3.euler(z=angle)) @ se3.invert(HERE)


@pytest.mark.parametrize("yaw", [0.0, 0.53, 1.9])
def test_the_best_turns_lay_a_mark_onto_itself(yaw):
    found = turns(marked_can(0.0, HERE), marked_can(yaw, THERE)).best(T)
    # The strip looks the same half a turn round.
    away = se3.rotation_distance(np.stack(found), T @ about(yaw))
    assert np.minimum(away, np.pi - away).min() < np.radians(2.0)


@pytest.mark.parametrize("off", [-0.25, -0.1, 0.0, 0.2])
def test_a_turn_nearby_lays_a_mark_onto_itself(off):
    found = turns(marked_can(0.0, HERE), marked_can(0.4, THERE)).nearby(T @ about(0.4 + off))
    assert se3.rotation_distance(found, T @ about(0.4)) < max(np.radians(3.0), 0.6 * abs(off))
    np.testing.assert_allclose(se3.apply(found, CENTER[None])[0], THERE[:3, 3], atol=1e-9)


def test_what_closest_points_turn_is_turned_back():
    turned = turns(marked_can(0.0, HERE), marked_can(0.4, THERE)).kept(T, T @ about(0.3))
    np.testing.assert_allclose(turned, T, atol=1e-9)


def test_without_an_axis_no_turn_is_chosen():
    can = marked_can(0.0, HERE)
    none = turns(can, can, axis=None)
    assert none.best(T) == []
    assert none.nearby(T) is T
    assert none.kept(np.eye(4), T) is T
