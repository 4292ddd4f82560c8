"""The routers: steps that follow each other, and the learned rule, with a stand-in for the network."""

from itertools import combinations

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from imop.geometry import se3
from imop.networks.graph import GraphConfig
from imop.networks.model import Model, ModelConfig
from imop.policy.router import AdvancingRouter, LearnedRouter, Odds, Option, holds, prior
from tests.networks.test_routing import ROUTING
from tests.policy.scenes import BLUE, RED, above, at, box, moved, scene, transitions

HOME = above(0, 0, 1)
LENGTH = 4
UNSURE = np.full(LENGTH, 1 / LENGTH)
STATE = scene([], HOME)
STEPS = transitions([STATE] * 4, [(HOME, True)] * 3)


def go(router, query=STATE):
    """Take the first option; asking twice gives the same."""
    found = router.options(query)
    assert found == router.options(query)
    router.took(found[0].demonstration, found[0].step)
    return found[0].demonstration, found[0].step


def test_steps_follow_each_other_once_taken_and_the_last_stays():
    router = AdvancingRouter()
    router.watch(STEPS)
    assert [go(router) for _ in range(5)] == [(0, 0), (0, 1), (0, 2), (0, 2), (0, 2)]
    router.reset()
    assert go(router) == (0, 0)


def test_what_was_not_carried_out_is_next_again():
    for router in (AdvancingRouter(), Told(UNSURE)):
        router.watch(STEPS)
        seen = []
        for carried_out in (True, False, False, True):
            seen.append(go(router)[1])
            if not carried_out:
                router.undo()
        assert seen == [0, 1, 1, 1] and go(router)[1] == 2
        router.reset()
        go(router)
        router.undo()
        assert go(router)[1] == 0


def test_the_first_step_decides_which_demonstration_is_followed():
    router = AdvancingRouter()
    router.watch(STEPS[:2])
    router.watch(STEPS)
    assert router.options(STATE) == (Option(0, 0), Option(1, 0))
    router.took(1, 0)
    assert [go(router) for _ in range(3)] == [(1, 1), (1, 2), (1, 2)]


class Told(LearnedRouter):
    """Hears the network's probabilities from the test."""

    def __init__(self, *probabilities, odds=None):
        super().__init__(None, odds)
        self.probabilities = probabilities

    def watch(self, steps):
        pass

    def scores(self, query):
        return [np.log(np.asarray(p, dtype=float)) for p in self.probabilities]

    def go(self, *probabilities):
        self.probabilities = probabilities
        return go(self)


def sure(step, doubt=1e-6):
    p = np.full(LENGTH, doubt)
    p[step] = 1.0
    return p


def test_states_that_look_the_same_follow_each_other_and_the_last_stays():
    router = Told()
    assert [router.go(UNSURE)[1] for _ in range(5)] == [0, 1, 2, 3, 3]
    router.reset()
    assert router.go(UNSURE) == (0, 0)


def test_a_slight_doubt_changes_nothing():
    """The network has to be five to one for a step before, and surer for a later one."""
    router = Told()
    for step in range(LENGTH):
        doubtful = np.full(LENGTH, 1.0)
        doubtful[step] = 0.25
        assert router.go(doubtful) == (0, step)


def test_a_failed_grasp_is_repeated():
    router = Told()
    seen = [router.go(sure(step))[1] for step in (0, 1, 0, 1, 2, 3)]
    assert seen == [0, 1, 0, 1, 2, 3]


def test_it_goes_on_after_its_retries():
    router = Told(odds=Odds(retries=2))
    seen = [router.go(sure(0))[1] for _ in range(7)]
    assert seen[:3] == [0, 0, 0] and 0 not in seen[3:] and seen[-1] == LENGTH - 1


def test_what_is_done_already_is_skipped_only_with_certainty():
    assert Told().go(sure(2, 1e-5)) == (0, 2)
    assert Told().go(sure(2, 1e-2)) == (0, 0)


def test_steps_that_need_what_was_lost_are_out_of_the_question(router):
    """The network that was not trained says nothing of it."""
    openings, actions = (1.0, 1.0, 0.4, 0.4, 1.0), (True, False, False, True)
    states = [scene([], above(0, 0, 1 - 0.05 * k), opening) for k, opening in enumerate(openings)]
    learned = LearnedRouter(router._model)
    learned.watch(transitions(states, [(HOME, opened) for opened in actions]))
    learned.took(0, 1)
    assert learned.options(states[2])[0].step == 2
    empty = scene([], states[2].observation.T_world_gripper, 0.0)
    assert learned.options(empty)[0].step < 2


@pytest.mark.parametrize(
    ("openings", "held"),
    [
        ((1.0, 0.4, 0.4, 1.0), [False, True, True, False]),
        ((1.0, 0.0, 0.0, 1.0), [False, False, False, False]),
        ((1.0, 0.7, 0.0, 1.0), [False, False, False, False]),  # still closing at the keyframe
    ],
)
def test_what_is_held_is_known_by_the_fingers_before_they_open(openings, held):
    states = [scene([], HOME, opening) for opening in (1.0, *openings)]
    steps = transitions(states, [(HOME, opened) for opened in (True, False, False, True)])
    assert holds(steps).tolist() == held
    assert holds(steps[:3]).tolist() == held[:3]


def test_of_several_demonstrations_one_is_followed_until_it_fails():
    router = Told(sure(0), 3 * sure(0))
    assert [(o.demonstration, o.step) for o in router.options(STATE)] == [(0, 0), (1, 0)]
    assert len({round(o.weight, 6) for o in router.options(STATE)}) == 1
    router.took(1, 0)
    router.probabilities = sure(1), sure(1)
    assert [(o.demonstration, o.step) for o in router.options(STATE)] == [(1, 1)]
    router.took(1, 1)
    router.probabilities = sure(0), sure(0)
    assert {o.demonstration for o in router.options(STATE)} == {0, 1}


@given(st.lists(st.integers(0, LENGTH - 1), min_size=1, max_size=40))
def test_an_episode_ends(steps):
    """Whatever is seen, no step is repeated for ever but the last."""
    router = Told()
    taken = [router.go(sure(step, 1e-9))[1] for step in steps]
    assert all(taken.count(step) <= LENGTH * (Odds().retries + 1) for step in range(LENGTH - 1))
    assert len(taken) < 4 * LENGTH * (Odds().retries + 1) or taken[-1] == LENGTH - 1


@pytest.fixture(scope="module")
def router():
    torch.manual_seed(0)
    router = LearnedRouter(Model(ModelConfig(routing=ROUTING, route_graph=GraphConfig(max_points=60))).eval())
    router.watch(transitions(STATES, [(HOME, True)] * 3))
    return router


STATES = [
    scene([box((0.05,) * 3, RED, at(0.1 * i, 0))], above(0, 0, 1 - 0.05 * i), 1 - 0.3 * i) for i in range(4)
]


def test_the_network_is_asked_about_every_demonstrated_step(router):
    (scores,) = router.scores(STATES[0])
    assert scores.shape == (3,) and np.isfinite(scores).all()


def test_it_knows_what_was_seen_before_the_last_action(router):
    router.reset()
    fresh = router.scores(STATES[1])[0]
    found = [fresh]
    for before in (STATES[0], STATES[3]):
        router.reset()
        router.options(before)
        np.testing.assert_array_equal(router.scores(STATES[1])[0], fresh)
        router.took(0, 0)
        found.append(router.scores(STATES[1])[0])
    router.reset()
    assert all(np.abs(a - b).max() > 1e-4 for a, b in combinations(found, 2))


def test_what_is_done_again_has_the_state_before_it_that_it_had_at_first(router):
    found = []
    for detour in (False, True):
        router.reset()
        router.options(STATES[0])
        router.took(0, 0)
        if detour:
            for state, step in ((STATES[1], 1), (STATES[3], 0)):
                router.options(state)
                router.took(0, step)
        found.append(router.scores(STATES[1])[0])
    np.testing.assert_array_equal(*found)


def test_odds_of_steps():
    odds = Odds(back=0.2, skip=0.01)
    np.testing.assert_allclose(prior(odds, 1, 4), [0.2, 1, 0.01, 0.01])
    np.testing.assert_allclose(prior(odds, 4, 4), [0.2, 0.2, 0.2, 1])


def test_time_steps_are_not_read(router):
    later = scene([box((0.05,) * 3, BLUE, at(0.1, 0))], above(0, 0, 0.9))
    first = router.scores(later)[0]
    object.__setattr__(later.observation, "time_step", 7)
    np.testing.assert_array_equal(router.scores(later)[0], first)


def test_it_does_not_matter_where_a_state_stands(router):
    """Clouds are thinned on a grid of 2 cm, so that scores change a little."""
    T = se3.make(se3.euler(z=0.8), (0.1, 0.05, 0))
    here = scene([box((0.06,) * 3, RED, at(0.1, 0))], above(0.1, 0, 0.9))
    there = scene([moved(box((0.06,) * 3, RED, at(0.1, 0)), T)], T @ above(0.1, 0, 0.9))
    a, b = router.scores(here)[0], router.scores(there)[0]
    np.testing.assert_allclose(a - a.mean(), b - b.mean(), atol=0.1)
