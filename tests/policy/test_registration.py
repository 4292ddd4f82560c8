"""The registration matcher on boxes."""

from dataclasses import replace

import numpy as np

from imop.geometry import se3
from imop.policy.interfaces import PolicyConfig, Progress
from imop.policy.registration import RegistrationMatcher
from tests.policy.scenes import BLUE, RED, TABLE, above, at, box, moved, scene, transitions

HOME = above(0.0, -0.3, 1.2)
GRASP = above(0.1, 0.1, TABLE + 0.05)
SIZE = (0.1, 0.05, 0.06)


def prepared(config=None):
    scenes = [scene([box(SIZE, RED, at(0.1, 0.1))], T) for T in (HOME, GRASP)]
    matcher = RegistrationMatcher.from_pretrained()
    matcher = replace(matcher, config=config or matcher.config)
    return matcher.prepare(transitions(scenes, [(GRASP, False)]))[0]


def test_the_box_of_the_same_colour_is_found():
    T = at(0.3, -0.2, yaw=1.2)
    query = scene([box(SIZE, RED, T, seed=1), box(SIZE, BLUE, at(0.1, 0.1), seed=2)], HOME)
    best = prepared().locate(query)[0]
    truth = T @ se3.invert(at(0.1, 0.1))
    half_turn = truth @ at(0.1, 0.1) @ se3.make(se3.euler(z=np.pi)) @ se3.invert(at(0.1, 0.1))
    errors = [
        se3.translation_distance(best.T_query_support @ GRASP, M @ GRASP)
        + se3.rotation_distance(best.T_query_support, M)
        for M in (truth, half_turn)
    ]
    assert min(errors) < 0.05


def test_two_equal_boxes_are_two_candidates():
    boxes = [box(SIZE, RED, at(x, y), seed=1) for x, y in ((0.3, -0.2), (0.0, 0.2))]
    # Nothing ends the search early.
    found = prepared(PolicyConfig(enough=1.0)).locate(scene(boxes, HOME))
    places = np.array([(c.T_query_support @ GRASP)[:2, 3] for c in found if c.probability > 0.3])
    for place in ((0.3, -0.2), (0.0, 0.2)):
        assert np.linalg.norm(places - place, axis=1).min() < 0.005


def test_candidates_come_likeliest_first():
    found = prepared().locate(scene([box(SIZE, RED, at(0.3, -0.2), seed=1)], HOME))
    p = [candidate.probability for candidate in found]
    assert p[0] > 0.5 and p == sorted(p, reverse=True) and p[-1] >= 0


def test_an_approached_thing_stays_the_aim():
    boxes = [box(SIZE, RED, at(x, y), seed=s) for s, (x, y) in enumerate(((0.3, -0.2), (0.0, 0.2)))]
    for x, y in ((0.3, -0.2), (0.0, 0.2)):
        hint = at(x, y, 0.0) @ se3.invert(at(0.1, 0.1, 0.0))
        step = prepared()
        query = scene(boxes, hint @ HOME)
        best = step.locate(query, Progress(hint))[0]
        assert se3.translation_distance(best.T_query_support @ GRASP, hint @ GRASP) < 0.01


def test_a_query_without_points_gives_no_candidate():
    query = scene([], HOME)
    empty = type(query)(query.observation, query.cloud.select(np.arange(0)))
    assert prepared().locate(empty) == ()


def test_moving_the_whole_scene_moves_the_answer(rng):
    T = at(0.05, -0.08, 0.0, yaw=0.4)
    thing = box(SIZE, RED, at(0.25, -0.1), seed=1)
    actions = [
        prepared().locate(scene([moved(thing, M)], HOME))[0].T_query_support @ GRASP for M in (np.eye(4), T)
    ]
    assert se3.translation_distance(T @ actions[0], actions[1]) < 0.005
