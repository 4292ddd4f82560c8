"""How an episode ends. The environment is played: what counts is which calls are made of it."""

from types import SimpleNamespace

import numpy as np
import pytest

from imop.evaluation.rollout import rollout
from imop.types import Action


class Played:
    """An environment whose steps give `info` and whose aim is reached by waiting, or not."""

    def __init__(self, info, rolls_on):
        self.info, self.rolls_on, self.waited = info, rolls_on, False
        self.observation = SimpleNamespace(stripped=lambda: None)

    def step(self, action):
        ended = bool(self.info.get("success") or "plan_failed" in self.info)
        return None, 0.0, ended, False, self.info

    def wait(self):
        self.waited = True
        return self.rolls_on


class Still:
    def reset(self):
        pass

    def act(self, observation):
        return Action(np.eye(4), True)


@pytest.mark.parametrize("rolls_on", [True, False])
def test_what_still_rolls_after_the_last_action_counts(rolls_on):
    env = Played({"success": False}, rolls_on)
    result = rollout(env, Still(), 2)
    assert env.waited and len(result.steps) == 2
    assert result.success == rolls_on


def test_success_and_failed_motions_end_an_episode_at_once():
    for info, success in (({"success": True}, True), ({"success": False, "plan_failed": "blocked"}, False)):
        env = Played(info, rolls_on=True)
        result = rollout(env, Still(), 2)
        assert (result.success, len(result.steps), env.waited) == (success, 1, False)
