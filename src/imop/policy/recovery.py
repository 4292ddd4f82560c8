"""Which actions of an episode failed, as far as it can be observed; the search tries them last.

An action failed if the arm is not where it was sent, or if the router goes back to its step or to one before
it. What the arm cannot do, it cannot do a moment later either. An action that was carried out and then failed
may have been right all the same, so its probability falls by Bayes' rule only.

Two steps that follow each other are often fixed to the same place of a thing: come near, then close. Then
their motions are the same. If the second is found elsewhere, the thing was moved or the first was
wrong, and in either case the first has to be done again. This says something
only about steps that leave the hand empty, because what is in the hand stays in it.
"""

from collections import defaultdict
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from imop.geometry import se3
from imop.geometry.neighbours import within
from imop.policy.contacts import SAME
from imop.policy.interfaces import PreparedStep, Tried
from imop.policy.router import Option
from imop.types import FloatArray, Observation

# An arm that is farther than this from where it was sent, metres and radians, was not moved there.
ARRIVED = (0.02, np.radians(10.0))
# Regions that have more than this share in common are the same; not tuned.
SAME_PLACE = 0.5
# How often what is right fails all the same: the thing slips, or somebody moves it. A guess, about
# as often as the oracle fails; not tuned.
BAD_LUCK = 0.1


def same_place(steps: Sequence[PreparedStep]) -> list[bool]:
    """For each step of a demonstration, whether it is fixed to the same place as the step before it."""
    return [False] + [_overlap(a.region, b.region) > SAME_PLACE for a, b in pairwise(steps)]


def _overlap(p_a: FloatArray, p_b: FloatArray) -> float:
    """The share of either region (N, 3), (M, 3) that lies in the other, whichever is less."""
    if not len(p_a) or not len(p_b):
        return 0.0
    return float(min(within(p_a, p_b, SAME).mean(), within(p_b, p_a, SAME).mean()))


class Attempts:
    """The actions of one episode."""

    def __init__(self) -> None:
        self._sent: tuple[int, int, FloatArray] | None = None
        self._redone: set[tuple[int, int]] = set()
        self._taken: list[tuple[int, int, FloatArray]] = []
        self._failed: dict[tuple[int, int], list[Tried]] = defaultdict(list)

    def took(self, option: Option, T_world_gripper: FloatArray) -> None:
        """The arm is sent to a pose (4, 4), for a step."""
        if self._taken and self._taken[-1][:2] == (option.demonstration, option.step):
            # What begins again is forgotten before (`go_on`), so `undone` led here.
            self._redone.add((option.demonstration, option.step))
        self._sent = option.demonstration, option.step, T_world_gripper
        self._taken.append(self._sent)

    def arrived(self, observation: Observation) -> bool:
        """Whether the arm is where it was sent last; if not, that is remembered."""
        if self._sent is None or se3.near(observation.T_world_gripper, self._sent[2], *ARRIVED):
            return True
        demonstration, step, T_sent = self._sent
        self._failed[demonstration, step].append(Tried(T_sent, 0.0))
        self._taken = [one for one in self._taken if one is not self._sent]
        self._sent = None
        return False

    def undone(self, option: Option, T_found: FloatArray, T_held: FloatArray) -> bool:
        """Whether the step before, which was done last, has to be done again, but each only once.

        Args:
            option: the step that was to come now, fixed to the same place as the one before.
            T_found: (4, 4) where it would take the gripper.
            T_held: (4, 4) where it would, if the motion of the step before still held.
        """
        before = option.demonstration, option.step - 1
        if not self._taken or self._taken[-1][:2] != before or before in self._redone:
            return False
        return bool(se3.translation_distance(T_found, T_held) >= ARRIVED[0])

    def go_on(self, option: Option) -> tuple[Tried, ...]:
        """What was tried in vain for a step that may be done now.

        What was done for it before, and for those after it, has failed if it has to be done again.
        """
        number, again = option.demonstration, option.step
        begun = (k for k, (n, step, _) in enumerate(self._taken) if n == number and step >= again)
        first = next(begun, len(self._taken))
        for n, step, T in self._taken[first:]:
            self._failed[n, step].append(Tried(T, BAD_LUCK))
        del self._taken[first:]
        return tuple(self._failed[number, again])
