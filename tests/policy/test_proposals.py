"""What is proposed: what matches agree on, upright and straightened motions, turns that change nothing."""

import numpy as np
import pytest

from imop.geometry import se3
from imop.geometry.cloud import concatenate
from imop.policy.proposals import (
    ROUND,
    Matches,
    all_turns,
    equal_turns,
    half_turn,
    onto,
    straightened,
    upright_motions,
)
from imop.policy.target import Target, middle
from tests.policy.scenes import BLUE, RED, TABLE, above, at, box, colored, scene

SIZE = (0.1, 0.05, 0.06)
HERE, THERE = at(0.1, 0.1), at(0.3, -0.2, yaw=1.2)
T = THERE @ se3.invert(HERE)
CENTER = np.array([0.1, 0.1, TABLE])
TURNS = 24


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


def can(radius=0.04, height=0.08, spacing=0.004):
    rng = np.random.default_rng(0)
    count = int(2 * np.pi * radius * height / spacing**2)
    angle = rng.uniform(0, 2 * np.pi, count)
    out = np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1)
    points = radius * out + rng.uniform(0, height, count)[:, None] * [0, 0, 1] + CENTER
    return colored(points, out, RED)


def angles(cloud):
    turns = equal_turns(cloud)
    assert np.array_equal(turns[0], np.eye(4))
    return np.degrees(se3.rotation_distance(turns, np.eye(4))).round()


def test_a_can_looks_the_same_in_every_turn():
    assert len(angles(can())) == 8


def test_every_turn_of_a_can_leaves_it_where_it_is():
    cloud = can()
    turns = all_turns(equal_turns(cloud), TURNS)
    assert len(turns) == TURNS and onto(cloud.points[::5], cloud.points, turns).min() > 0.8
    away = np.degrees(se3.rotation_distance(turns, np.eye(4))).round()
    assert sorted(away) == sorted(min(15.0 * k, 360.0 - 15.0 * k) for k in range(TURNS))


def test_most_turns_are_enough_to_be_round():
    """Of what was seen from one side, some turns show the side that was not."""
    cloud = can()
    turns = equal_turns(cloud)
    for kept in ([0, 1, 2, 4, 7], [0, 1, 2, 6, 7]):
        found = all_turns(turns[kept], TURNS)
        assert len(found) == TURNS and onto(cloud.points[::5], cloud.points, found).min() > 0.8
    assert len(all_turns(turns[: ROUND - 1], TURNS)) == ROUND - 1


def test_what_is_not_round_has_no_other_turns():
    turns = equal_turns(box((0.06, 0.06, 0.06), RED, HERE))
    assert all_turns(turns, TURNS) is turns


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
