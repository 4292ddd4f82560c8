"""The learned matcher with the bundled weights, on boxes and on real demonstrations."""

import numpy as np
import pytest

from imop.demos.rlbench import read_episode
from imop.evaluation.predict import predict
from imop.geometry import se3
from imop.networks.model import load_model
from imop.policy.interfaces import Progress
from imop.policy.learned import LearnedMatcher
from imop.policy.one_shot import OneShotPolicy
from tests.policy.scenes import BLUE, GREEN, RED, TABLE, above, at, box, moved, scene, transitions

HOME = above(0.0, -0.3, 1.2)
GRASP = above(0.1, 0.1, TABLE + 0.05)
SIZE = (0.1, 0.05, 0.06)
# Rules used to do this. The verification has to learn it, from networks that saw such steps in training.
NOT_YET = pytest.mark.xfail(reason="the bundled verification has not learned it", strict=False)


@pytest.fixture(scope="module")
def matcher():
    return LearnedMatcher(load_model())


def steps(T=None, size=SIZE):
    T = np.eye(4) if T is None else T
    scenes = [scene([moved(box(size, RED, at(0.1, 0.1)), T)], T @ pose) for pose in (HOME, GRASP)]
    return transitions(scenes, [(T @ GRASP, False)])


def test_the_region_is_part_of_the_demonstrated_scene(matcher):
    before = steps()[0].before.cloud.points
    region = matcher.prepare(steps())[0].region
    assert 0 < len(region) < len(before)
    assert all((point == before).all(axis=1).any() for point in region[::50])


def test_the_region_moves_with_the_scene(matcher):
    T = at(0.05, -0.08, 0.0, yaw=0.4)
    here, there = (matcher.prepare(steps(M))[0].region for M in (np.eye(4), T))
    # The thinning grid does not turn with the scene, so that single points may come and go.
    distance = np.linalg.norm(se3.apply(T, here)[::20, None] - there[None], axis=-1).min(axis=1)
    assert np.mean(distance < 0.02) > 0.8


def test_an_unchanged_scene_is_recognised(matcher):
    step = matcher.prepare(steps())[0]
    best = step.locate(steps()[0].before)[0]
    assert se3.translation_distance(best.T_query_support @ GRASP, GRASP) < 0.005
    assert se3.rotation_distance(best.T_query_support, np.eye(4)) < 0.05


def test_a_hint_is_tried(matcher):
    T = at(0.3, -0.2, yaw=1.2) @ se3.invert(at(0.1, 0.1))
    query = scene([moved(box(SIZE, RED, at(0.1, 0.1)), T)], HOME)
    best = matcher.prepare(steps())[0].locate(query, Progress(T))
    assert max(h.probability for h in best) > 0.5


def test_the_same_question_has_the_same_answer(matcher):
    query = scene([box(SIZE, RED, at(0.3, -0.2)), box(SIZE, BLUE, at(0.0, 0.2))], HOME)
    first, second = (matcher.prepare(steps())[0].locate(query) for _ in range(2))
    assert np.array_equal(first[0].T_query_support, second[0].T_query_support)


GRAY, YELLOW = (0.5, 0.5, 0.5), (0.8, 0.7, 0.1)


def chain(side):
    """Links that wind to one `side` and back, with a red and a blue end; the pose that grasps the red one."""
    s = np.linspace(0.0, 1.0, 17)
    heading = side * 1.1 * np.cos(2 * np.pi * s)
    xy = np.cumsum(0.026 * np.stack([np.cos(heading), np.sin(heading)], axis=1), axis=0) - 0.1
    colors = [RED, *[GRAY] * (len(s) - 2), BLUE]
    links = [
        box((0.03, 0.02, 0.02), c, at(*p, yaw=yaw)) for c, p, yaw in zip(colors, xy, heading, strict=True)
    ]
    return links, above(*xy[0], TABLE + 0.01) @ se3.make(se3.euler(z=-heading[0]))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_what_bent_is_found_by_the_end_that_is_grasped(matcher, side):
    links, grasp = chain(side)
    step = matcher.prepare(transitions([scene(links, HOME), scene(links, grasp, 0.5)], [(grasp, False)]))[0]
    links, wanted = chain(-side)
    best = step.locate(scene(links, HOME))[0]
    assert se3.translation_distance(best.T_query_support @ grasp, wanted) < 0.02


def test_a_query_without_points_gives_no_candidate(matcher):
    query = scene([], HOME)
    empty = type(query)(query.observation, query.cloud.select(np.arange(0)))
    assert matcher.prepare(steps())[0].locate(empty) == ()


@NOT_YET
def test_what_is_taken_is_found_where_it_moved_on_what_carries_it(matcher):
    def chest_with(note, T):
        return [moved(box((0.24, 0.2, 0.1), GRAY, at(0.1, 0.1)), T), moved(note, T)]

    top = TABLE + 0.1
    note = box((0.09, 0.05, 0.02), RED, at(0.05, 0.05, top))
    grasp, lift = above(0.05, 0.05, top + 0.015), above(0.05, 0.05, top + 0.25)
    lifted = moved(note, lift @ se3.invert(grasp))
    shown = [
        scene(chest_with(note, np.eye(4)), HOME),
        scene(chest_with(note, np.eye(4)), grasp, 0.5),
        scene([chest_with(note, np.eye(4))[0], lifted], lift, 0.5),
    ]
    step = matcher.prepare(transitions(shown, [(grasp, False), (lift, False)]))[0]
    T = at(0.05, -0.1, 0.0, yaw=0.3)
    T_slid = at(0.15, 0.13, top, yaw=0.4) @ se3.invert(at(0.05, 0.05, top))
    query = scene(chest_with(moved(note, T_slid), T), HOME)
    best = step.locate(query)[0].T_query_support
    assert se3.translation_distance(best @ grasp, T @ T_slid @ grasp) < 0.015


@pytest.mark.parametrize(
    ("color", "other", "new"),
    [(RED, GREEN, BLUE), (BLUE, YELLOW, RED), pytest.param(GREEN, YELLOW, BLUE, marks=NOT_YET)],
)
def test_what_has_a_new_colour_is_found_by_its_shape_and_not_in_that_of_another(matcher, color, other, new):
    shown = [box(SIZE, color, at(0.1, 0.1)), box(SIZE, other, at(0.35, -0.15))]
    step = matcher.prepare(transitions([scene(shown, HOME), scene(shown, GRASP, 0.5)], [(GRASP, False)]))[0]
    for x, y in ((0.3, 0.2), (0.0, 0.2)):
        asked = [box(SIZE, new, at(x, y)), box(SIZE, other, at(0.2, -0.1))]
        best = step.locate(scene(asked, HOME))[0]
        assert se3.translation_distance(best.T_query_support @ GRASP, above(x, y, TABLE + 0.05)) < 0.02
        same = [box(SIZE, color, at(x, y)), asked[1]]
        assert best.probability < step.locate(scene(same, HOME))[0].probability


def test_what_is_in_the_hand_is_known_in_any_colour(matcher):
    cube, lift, high = (
        box(SIZE, RED, at(0.1, 0.1)),
        above(0.1, 0.1, TABLE + 0.25),
        above(0.1, 0.1, TABLE + 0.4),
    )

    def held(color, T):
        return scene([moved(box(SIZE, color, at(0.1, 0.1)), T @ se3.invert(GRASP))], T, 0.5)

    shown = [scene([cube], HOME), held(RED, GRASP), held(RED, lift), held(RED, high)]
    steps = transitions(shown, [(GRASP, False), (lift, False), (high, False)])
    T = at(0.2, -0.1, 0.0, yaw=0.7)
    best = matcher.prepare(steps)[2].locate(held(BLUE, T @ lift))[0]
    assert se3.translation_distance(best.T_query_support, T) < 0.005 and best.probability > 0.5


def test_real_demonstrations(matcher, perception, rlbench_demos):
    episodes = rlbench_demos / "open_drawer" / "all_variations" / "episodes"
    policy = OneShotPolicy(matcher, perception)
    policy.watch(read_episode(episodes / "episode5").stripped())
    predictions = predict(policy, read_episode(episodes / "episode3"))
    assert [p.within_1cm_5deg for p in predictions] == [True, True, True]
