"""What is looked at is what the policy would do; what is taken is what it goes on from."""

from types import SimpleNamespace

import numpy as np
import pytest

from imop.errors import InvalidInput, NoConfidentMatch
from imop.geometry import se3
from imop.geometry.focus import Focus
from imop.policy.interfaces import Candidate
from imop.policy.one_shot import OneShotPolicy
from imop.types import Action, Demonstration, Keyframe
from imop.viewing.deciders import ActingDecider, PolicyDecider
from tests.viewing.scenes import ACTIONS, BLUE_AT, GREEN_AT, MOVED, demonstrated_scene, look, region_of

SEEN = demonstrated_scene()
OTHER = BLUE_AT @ se3.invert(GREEN_AT)
DEMONSTRATION = Demonstration(
    tuple(Keyframe(SEEN.observation, action) for action in ACTIONS), SEEN.observation
)
PERCEPTION = SimpleNamespace(points=lambda observation: SEEN.fused, align_views=False, robot_mask=None)


class Step:
    """A prepared step that has two candidates and remembers what was done before."""

    region = region_of(SEEN)
    spread = np.full(len(region), 0.004)

    def __init__(self):
        self.asked = []

    def locate(self, query, progress=None, feasible=None):
        self.asked.append(progress.T_last)
        matched = (self.region[:5], se3.apply(MOVED, self.region[:5]))
        return (Candidate(MOVED, 0.7, *matched, generator="fit"), Candidate(OTHER, 0.2, generator="anywhere"))


@pytest.fixture
def steps():
    return [Step(), Step()]


def watched(steps, min_confidence=0.0):
    matcher = SimpleNamespace(prepare=lambda transitions: steps)
    policy = OneShotPolicy(matcher, PERCEPTION, min_confidence=min_confidence)
    policy.watch(DEMONSTRATION)
    return policy


def test_a_look_is_what_the_policy_would_do(steps):
    decider = PolicyDecider(watched(steps))
    seen = decider.decide(SEEN.observation)
    assert [action.confidence for action in seen.choices] == [0.7, 0.2]
    assert seen.action.match.generator == "fit" and len(seen.action.match.p_query) == 5
    assert seen.shown.step == 0 and len(seen.shown.actions) == 2
    assert np.array_equal(seen.shown.spread, Step.spread)
    expected = watched(steps).act(SEEN.observation)
    assert np.array_equal(seen.action.T_world_gripper, expected.T_world_gripper)


@pytest.mark.parametrize(("number", "T"), [(0, MOVED), (1, OTHER)])
def test_the_episode_goes_on_from_what_was_taken(steps, number, T):
    decider = PolicyDecider(watched(steps))
    decider.reset()
    decider.decide(SEEN.observation)
    decider.decide(SEEN.observation)
    decider.take(number)
    assert decider.decide(SEEN.observation).shown.step == 1
    assert steps[0].asked == [None, None] and np.allclose(steps[1].asked[-1], T)


def test_only_so_many_candidates_are_choices(steps):
    assert len(PolicyDecider(watched(steps), most=1).decide(SEEN.observation).choices) == 1


def test_what_is_not_believed_is_no_choice_and_that_is_said(steps):
    seen = PolicyDecider(watched(steps, min_confidence=0.9)).decide(SEEN.observation)
    assert seen.choices == () and "0.90" in seen.problem and len(seen.scene.fused)


class Acting:
    """Has act and nothing else, as a client has."""

    def __init__(self, action):
        self.action, self.resets = action, 0

    def watch(self, demonstration):
        pass

    def reset(self):
        self.resets += 1

    def act(self, observation):
        if self.action is None:
            raise NoConfidentMatch(0.2, 0.5)
        return self.action


def test_of_what_only_acts_the_match_is_shown():
    wanted = look().choices[0]
    policy = Acting(wanted)
    decider = ActingDecider(policy, DEMONSTRATION, PERCEPTION)
    decider.reset()
    seen = decider.decide(SEEN.observation)
    decider.take(0)
    assert seen.choices == (wanted,) and seen.shown.step == wanted.match.step and policy.resets == 1
    assert seen.shown.spread is None


def test_what_tells_no_match_is_shown_without_a_demonstration():
    seen = ActingDecider(Acting(Action(np.eye(4), True)), DEMONSTRATION, PERCEPTION).decide(SEEN.observation)
    assert len(seen.choices) == 1 and seen.shown is None


def test_what_only_acts_may_be_unsure():
    seen = ActingDecider(Acting(None), DEMONSTRATION, PERCEPTION).decide(SEEN.observation)
    assert "0.50" in seen.problem and seen.choices == ()


def test_what_counts_its_steps_is_asked_again_only_where_nothing_was_done():
    policy = Acting(look().choices[0])
    decider = ActingDecider(policy, DEMONSTRATION, PERCEPTION)
    decider.decide(SEEN.observation)
    decider.decide(SEEN.observation)
    assert policy.resets == 1
    decider.take(0)
    decider.decide(SEEN.observation)
    with pytest.raises(InvalidInput, match="again"):
        decider.decide(SEEN.observation)
    assert policy.resets == 1


def test_a_focus_is_told_to_whom_it_can_be_told():
    told, focus = [], Focus(points=BLUE_AT[None, :3, 3])
    with pytest.raises(InvalidInput, match="focus"):
        ActingDecider(Acting(None), DEMONSTRATION, PERCEPTION).decide(SEEN.observation, focus)

    class Told(Acting):
        def act(self, observation, focus=None):
            told.append(focus)
            return self.action

    decider = ActingDecider(Told(look().choices[0]), DEMONSTRATION, PERCEPTION)
    decider.decide(SEEN.observation, focus)
    decider.decide(SEEN.observation)
    assert told == [focus, None]
