"""Policies to compare with."""

from imop.errors import InvalidInput
from imop.types import Action, Demonstration, Observation


class ReplayPolicy:
    """Repeats the demonstrated poses without looking."""

    def __init__(self) -> None:
        self._actions: list[Action] = []
        self._next = 0

    def watch(self, demonstration: Demonstration) -> None:
        """Remember the actions of the first demonstration."""
        if not self._actions:
            self._actions = [keyframe.action for keyframe in demonstration.keyframes]

    def reset(self) -> None:
        """Begin a new episode."""
        self._next = 0

    def act(self, observation: Observation) -> Action:
        """The next demonstrated action; after the last one, the last one again.

        Raises:
            InvalidInput: if nothing was watched.
        """
        if not self._actions:
            raise InvalidInput("demonstration", "none was watched", "call watch(demonstration) before act")
        action = self._actions[min(self._next, len(self._actions) - 1)]
        self._next += 1
        return action
