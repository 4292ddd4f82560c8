"""Where things happen: a recording, a simulated scene, a robot."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from imop.types import Action, Demonstration, FloatArray, Observation


@dataclass(frozen=True)
class Outcome:
    """How a motion went.

    Attributes:
        over: whether the episode has ended.
        words: what happened, for people; empty if nothing is to be said.
        failed: why the motion was not done; None if it was.
    """

    over: bool
    words: str = ""
    failed: str | None = None


class World(Protocol):
    """What a session looks at and acts in. Only `stop` may be called while another call has not returned."""

    def observe(self) -> Observation:
        """What is seen now, without anything that only a simulator knows.

        Raises:
            ImopError, ConnectionError: if nothing can be seen.
        """
        ...

    def way(self, action: Action) -> FloatArray:
        """(K, 3) the way of the tip to an action's pose, metres; nothing moves.

        Raises:
            PlanFailed: if there is none.
        """
        ...

    def known(self) -> FloatArray | None:
        """T_world_gripper (4, 4) that the gripper is known to have gone to from here; None if it is not."""
        ...

    def perform(self, action: Action) -> Outcome:
        """Do it.

        Raises:
            ImopError, ConnectionError: if it was not even begun.
        """
        ...

    def stop(self) -> None:
        """Bring to rest what moves; may be called from any thread."""
        ...


def straight(T_world_gripper: FloatArray, action: Action) -> FloatArray:
    """(2, 3) the straight way of the tip from a pose (4, 4) to an action's, metres."""
    return np.stack([T_world_gripper[:3, 3], action.T_world_gripper[:3, 3]])


class RecordedWorld:
    """A recorded episode: nothing moves, each action is followed by the next keyframe.

    Args:
        recorded: the episode.
    """

    def __init__(self, recorded: Demonstration) -> None:
        self._recorded, self._number = recorded, 0

    def observe(self) -> Observation:
        """What was seen at the present keyframe."""
        return self._recorded.keyframes[self._number].observation.stripped()

    def way(self, action: Action) -> FloatArray:
        """Straight, since nobody plans."""
        return straight(self.observe().T_world_gripper, action)

    def known(self) -> FloatArray:
        """Where the gripper went."""
        return self._recorded.keyframes[self._number].action.T_world_gripper

    def perform(self, action: Action) -> Outcome:
        """The next keyframe; the last one stays."""
        if self._number + 1 == len(self._recorded):
            return Outcome(True, "the recording ends here")
        self._number += 1
        return Outcome(False)

    def stop(self) -> None:
        """Nothing moves."""
