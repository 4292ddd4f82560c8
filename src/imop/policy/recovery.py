"""What was tried in an episode and came to nothing, by what is observed: there it is looked for last again.

An action came to nothing if the arm is not where it was sent, or if the router goes back to its step or to
one before it. What the arm cannot do, it cannot do a moment later. What it did and what then failed may have
been right all the same, so its probability falls by Bayes' rule only.
"""

from collections import defaultdict

import numpy as np

from imop.geometry import se3
from imop.policy.interfaces import Tried
from imop.types import FloatArray, Observation

# An arm that is farther than this from where it was sent, metres and radians, was not moved there.
ARRIVED = (0.02, np.radians(10.0))
# How often what is right fails all the same: the thing slips, or somebody moves it.
BAD_LUCK = 0.1

Place = tuple[int, int]
"""Number of a demonstration and of its step."""


class Attempts:
    """The actions of one episode."""

    def __init__(self) -> None:
        self._taken: list[tuple[Place, FloatArray]] = []
        self._failed: dict[Place, list[Tried]] = defaultdict(list)

    def took(self, place: Place, T_world_gripper: FloatArray) -> None:
        """The arm is sent to a pose (4, 4), for a step."""
        self._taken.append((place, T_world_gripper))

    def arrived(self, observation: Observation) -> bool:
        """Whether the arm is where it was sent last; if not, that is remembered."""
        if not self._taken:
            return True
        place, T_sent = self._taken[-1]
        if se3.near(observation.T_world_gripper, T_sent, *ARRIVED):
            return True
        self._failed[place].append(Tried(T_sent, 0.0))
        self._taken.pop()
        return False

    def go_on(self, place: Place) -> tuple[Tried, ...]:
        """What was tried in vain for a step that is to be done now.

        What was done for it before, and for those after it, has failed if it has to be done again.
        """
        demonstration, step = place
        while self._taken and self._taken[-1][0][0] == demonstration and self._taken[-1][0][1] >= step:
            again, T = self._taken.pop()
            self._failed[again].append(Tried(T, BAD_LUCK))
        return tuple(self._failed[place])
