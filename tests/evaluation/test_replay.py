"""Replay."""

import pytest

from imop.errors import InvalidInput
from imop.evaluation.replay import ReplayPolicy


def test_replay_repeats_the_demonstration_and_then_its_last_action(shown, wanted):
    policy = ReplayPolicy()
    policy.watch(shown)
    seen = wanted.keyframes[0].observation
    for _ in range(2):
        policy.reset()
        actions = [policy.act(seen) for _ in range(len(shown) + 1)]
        assert actions[:-1] == [keyframe.action for keyframe in shown.keyframes]
        assert actions[-1] is actions[-2]


def test_replay_needs_a_demonstration(wanted):
    with pytest.raises(InvalidInput) as error:
        ReplayPolicy().act(wanted.keyframes[0].observation)
    assert error.value.field == "demonstration"
