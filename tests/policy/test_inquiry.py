"""Confirming one motion without a search, on boxes."""

from dataclasses import replace

import numpy as np
import pytest

from imop.geometry import se3
from imop.geometry.clusters import find_objects
from imop.policy.inquiry import Inquiry
from imop.policy.region import Region
from imop.policy.search import Search, SearchConfig
from imop.policy.things import Things
from tests.policy.scenes import RED, above, at, box, scene

HOME = above(0.0, -0.3, 1.2)
SIZE = (0.1, 0.05, 0.06)
HERE, THERE = at(0.1, 0.1), at(0.3, -0.2, yaw=1.2)
T = THERE @ se3.invert(HERE)


def inquiry(poses, hints=(), opinion=None, weight=0.01):
    cloud = box(SIZE, RED, HERE)
    region = Region(cloud, np.ones(len(cloud)), np.zeros((0, 3)))
    search = Search(SearchConfig(turned=2, opinion=weight), scene([cloud], HOME), region)
    query = scene([box(SIZE, RED, pose, seed=1 + k) for k, pose in enumerate(poses)], HOME)
    things = Things(query, find_objects(query.cloud, query.ground.plane).cloud)
    return Inquiry(search, things, hints, opinion)


def test_a_motion_that_is_nearly_right_is_confirmed_and_mended():
    found = inquiry([THERE]).confirmed((at(0.008, -0.006, 0.0) @ T)[None])
    error = se3.translation_distance(found[0].T_query_support @ HERE, THERE)
    assert error < 0.003 and found[0].score > 0.9


def test_a_motion_to_nowhere_is_not_confirmed():
    assert inquiry([THERE]).confirmed((at(0.0, 0.3, 0.0) @ T)[None]) == ()


def test_a_motion_is_not_confirmed_if_the_aim_so_far_is_as_good():
    other = at(0.0, 0.2)
    hint = other @ se3.invert(HERE)
    assert inquiry([THERE, other], [hint]).confirmed(T[None]) == ()
    assert inquiry([THERE, other], [T]).confirmed(T[None]) != ()


def test_of_equal_turns_the_demonstrated_one_is_preferred():
    # A box looks the same after half a turn; the gripper has not turned since the demonstration.
    half_turn = at(0.3, -0.2, yaw=np.pi) @ se3.invert(HERE)
    best = inquiry([at(0.3, -0.2)]).confirmed(half_turn[None])[0]
    assert se3.rotation_distance(best.T_query_support, np.eye(4)) < 0.05
    assert abs(best.T_query_support[2, 3]) < 0.003


def test_the_matchers_opinion_decides_between_equal_explanations():
    other = at(0.0, 0.2)
    motions = [pose @ se3.invert(HERE) for pose in (THERE, other)]
    for wanted in motions:

        def opinion(T, wanted=wanted):
            return (se3.translation_distance(T @ HERE, wanted @ HERE) < 0.02).astype(float)

        best = inquiry([THERE, other], opinion=opinion, weight=0.1).search(np.stack(motions))[0]
        assert se3.translation_distance(best.T_query_support @ HERE, wanted @ HERE) < 0.01


def test_what_was_followed_is_followed_on_and_mended():
    hint = at(0.004, -0.003, 0.0) @ T
    found = inquiry([THERE], [hint]).followed()
    assert se3.translation_distance(found[0].T_query_support @ HERE, THERE) < 0.002
    assert found[0].score > 0.9


def test_nothing_is_followed_at_the_beginning_or_where_it_is_gone():
    assert inquiry([THERE]).followed() == ()
    assert inquiry([at(0.0, 0.3)], [T]).followed() == ()


def test_between_the_hint_and_what_the_gripper_did_nothing_is_followed():
    # One box where the hint says, and an equal one where it stood in the demonstration.
    assert inquiry([THERE, HERE], [T]).followed() == ()


def test_around_is_where_the_region_may_be():
    search = inquiry([THERE])._search
    points = np.stack([THERE[:3, 3], HERE[:3, 3], THERE[:3, 3] + [0, 0, 0.3], [-0.4, 0.4, 0.8]])
    np.testing.assert_array_equal(search.around(points, T[None]), [True, False, False, False])
    np.testing.assert_array_equal(search.around(points, np.stack([T, np.eye(4)])), [True, True, False, False])


def test_the_motion_begun_is_kept_if_it_explains_about_as_much():
    # The gripper has not moved since the demonstration, nor has the box.
    begun = inquiry([HERE], [np.eye(4)])
    turned = replace(begun.repeated()[0], T_query_support=at(0.01, 0.0, 0.0))
    assert begun.kept((turned,))[0].T_query_support == pytest.approx(np.eye(4), abs=1e-2)
    elsewhere = replace(turned, T_query_support=at(0.1, 0.0, 0.0))
    assert begun.kept((elsewhere,)) == (elsewhere,)
    gone = inquiry([THERE], [np.eye(4)])
    assert gone.kept((turned,)) == (turned,)


def test_what_bends_is_turned_about_where_it_ends():
    turned = THERE @ at(0.0, 0.0, 0.0, yaw=1.2)
    asked = inquiry([turned])
    found = (asked.finished(T),)
    best = asked.bent(found, HERE[:3, 3])[0]
    assert best.score > 0.9 and found[0].score < 0.8
    assert se3.translation_distance(best.T_query_support @ HERE, turned) < 0.01


def test_what_is_explained_already_is_not_turned():
    asked = inquiry([THERE])
    found = (asked.finished(T),)
    assert asked.bent(found, HERE[:3, 3]) == found


def test_what_slipped_in_the_hand_is_found_beside_where_it_was_carried():
    # The gripper is where it was in the demonstration.
    slipped = inquiry([at(0.115, 0.092)], [np.eye(4)]).slipped()
    assert slipped.T_query_support[:3, 3] == pytest.approx([0.015, -0.008, 0.0], abs=0.003)
    assert slipped.score > 0.9
