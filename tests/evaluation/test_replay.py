"""Replay."""

import pytest

from imop.errors import InvalidInput
from imop.evaluation.replay import ReplayPolicy
from imop.types import Action, Demonstration, Keyframe
from tests.policy.scenes import above, scene


@pytest.fixture(scope="module")
def shown():
    """Three steps up, the hand open and closed in turn."""
    poses = [above(0.1, 0.1, 1.0 + 0.1 * k) for k in range(4)]
    seen = [scene([], T).observation for T in poses]
    steps = [
        Keyframe(o, Action(T, k % 2 == 0)) for k, (o, T) in enumerate(zip(seen, poses[1:], strict=False))
    ]
    return Demonstration(tuple(steps), seen[-1])


def test_replay_repeats_the_demonstration_and_then_its_last_action(shown):
    policy = ReplayPolicy()
    policy.watch(shown)
    seen = shown.final
    for _ in range(2):
        policy.reset()
        actions = [policy.act(seen) for _ in range(len(shown) + 1)]
        assert actions[:-1] == [keyframe.action for keyframe in shown.keyframes]
        assert actions[-1] is actions[-2]


def test_replay_needs_a_demonstration(shown):
    with pytest.raises(InvalidInput) as error:
        ReplayPolicy().act(shown.final)
    assert error.value.field == "demonstration"
