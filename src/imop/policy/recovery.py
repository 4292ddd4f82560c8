"""What was tried in an episode and came to nothing, by what is observed: there it is looked for last again.

An action came to nothing if the arm is not where it was sent, or if the router goes back to its step or to
one before it. What the arm cannot do, it cannot do a moment later. What it did and what then failed may have
been right all the same, so its probability falls by Bayes' rule only.
"""

from collections import defaultdict

import numpy as np

from imop.geometry import se3
from imop.policy.interfaces import Tried
from imop.policy.router import Option
from imop.types import FloatArray, Observation

# An arm that is farther than this from where it was sent, metres and radians, was not moved there.
ARRIVED = (0.02, np.radians(10.0))
# How often what is right fails all the same: the thing slips, or somebody moves it.
BAD_LUCK = 0.1


class Attempts:
    """The actions of one episode."""

    def __init__(self) -> None:
        self._taken: list[tuple[int, int, FloatArray]] = []
        self._failed: dict[tuple[int, int], list[Tried]] = defaultdict(list)

    def took(self, option: Option, T_world_gripper: FloatArray) -> None:
        """The arm is sent to a pose (4, 4), for a step."""
        self._taken.append((option.demonstration, option.step, T_world_gripper))

    def arrived(self, observation: Observation) -> bool:
        """Whether the arm is where it was sent last; if not, that is remembered."""
        if not self._taken:
            return True
        demonstration, step, T_sent = self._taken[-1]
        if se3.near(observation.T_world_gripper, T_sent, *ARRIVED):
            return True
        self._failed[demonstration, step].append(Tried(T_sent, 0.0))
        self._taken.pop()
        return False

    def go_on(self, option: Option) -> tuple[Tried, ...]:
        """What was tried in vain for a step that may be done now.

        What was done for it before, and for those after it, has failed if it has to be done again.
        """
        begun = [
            k
            for k, (n, step, _) in enumerate(self._taken)
            if n == option.demonstration and step >= option.step
        ]
        if begun:
            for n, step, T in self._taken[begun[0] :]:
                self._failed[n, step].append(Tried(T, BAD_LUCK))
            del self._taken[begun[0] :]
        return tuple(self._failed[option.demonstration, option.step])
