"""A policy that is told the step: its router hears of it, and the episode goes on."""

import numpy as np
import pytest

from imop.errors import NoConfidentMatch
from imop.evaluation.told import Told
from imop.policy.interfaces import Candidate
from imop.policy.router import Option


class Policy:
    """Stands for one that has watched: its router would always begin, and it finds nothing in step 1."""

    def __init__(self):
        self.router, self.heard = self, []

    def reset(self):
        self.heard.append("reset")

    def see(self, observation):
        return observation

    def options(self, scene):
        return (Option(0, 7),)

    def took(self, demonstration, step):
        self.heard.append(step)

    def locate(self, scene, step, progress):
        self.heard.append(progress.T_last)
        if step == 1:
            raise NoConfidentMatch(0.0, 0.5)
        return FOUND


class FOUND:
    match = Candidate(2 * np.eye(4), 1.0, np.zeros((0, 3)), np.zeros((0, 3)))


def test_it_answers_the_step_it_was_told_and_says_what_it_would_have_chosen():
    told = Told(Policy())
    assert told.routed is None and told.act(None, 3) is FOUND and told.routed == 7
    told.reset()
    assert told.routed is None


def test_what_was_not_found_is_taken_all_the_same_and_the_last_motion_found_is_kept():
    policy = Policy()
    told = Told(policy)
    told.act(None, 0)
    with pytest.raises(NoConfidentMatch):
        told.act(None, 1)
    told.act(None, 2)
    T = FOUND.match.T_query_support
    assert policy.heard[:3] == [0, None, 1]
    assert policy.heard[3] is T and policy.heard[4] == 2 and policy.heard[5] is T
    told.reset()
    told.act(None, 0)
    assert policy.heard[-1] is None
