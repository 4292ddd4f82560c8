"""Matches as motions: what most of them agree on, and upright turns where they lead."""

import numpy as np
import pytest

from imop.geometry import se3
from imop.geometry.cloud import concatenate
from imop.policy.matches import Matches
from imop.policy.things import Things, middle
from tests.policy.scenes import BLUE, RED, above, at, box, scene

SIZE = (0.1, 0.05, 0.06)
HERE, THERE = at(0.1, 0.1), at(0.3, -0.2, yaw=1.2)
T = THERE @ se3.invert(HERE)


@pytest.fixture
def matches():
    cloud = box(SIZE, RED, HERE).select(np.arange(0, 600, 5))
    wrong = np.arange(len(cloud)) % 4 == 0
    y = np.where(wrong[:, None], np.roll(cloud.points, 7, axis=0) + 0.2, se3.apply(T, cloud.points))
    return Matches(cloud.points, cloud.normals, y, se3.rotate(T, cloud.normals), np.ones(len(cloud)))


def test_three_quarters_agree_on_the_right_motion(matches):
    np.testing.assert_allclose(matches.agreement(np.stack([T, np.eye(4)])), (0.75, 0.0), atol=0.01)


def test_triples_find_the_motion_although_some_matches_are_wrong(matches):
    best = matches.motions(4000, seed=0)[0]
    assert se3.translation_distance(best @ HERE, THERE) < 1e-3


def test_part_of_the_region_has_its_own_matches(matches):
    few = matches.x[:10]
    part = matches.of(few)
    assert len(part.x) >= 10 and len(part.x) < len(matches.x)
    assert np.linalg.norm(part.x[:, None] - few[None], axis=-1).min(axis=1).max() < 0.02


def test_upright_motions_go_to_the_thing_that_was_matched(matches):
    cloud = concatenate([box(SIZE, RED, THERE), box(SIZE, BLUE, at(0.0, -0.3))])
    things = Things(scene([], above(0, 0, 1.2)), cloud)
    p = middle(matches.x)
    turned = matches.upright(things, 1, 24, [p])
    # First the mean of the matches, wrong ones included, then the middle of the thing.
    moved = se3.apply(turned[24:], p[None])[:, 0]
    assert np.linalg.norm(moved[:, :2] - THERE[:2, 3], axis=1).max() < 0.01
    assert se3.rotation_distance(turned, np.tile(T, (len(turned), 1, 1))).min() < np.radians(7.6)


def test_without_matches_nothing_is_proposed(matches):
    none = matches.of(matches.x + 10.0)
    things = Things(scene([], above(0, 0, 1.2)), box(SIZE, RED, THERE))
    assert len(none.motions(4000, seed=0)) == 0
    assert len(none.upright(things, 1, 24, [middle(matches.x)])) == 0
