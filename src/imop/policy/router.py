"""Which demonstrated step the present state corresponds to."""

from collections.abc import Sequence
from typing import Protocol

from imop.policy.matcher import Scene, Transition


class Router(Protocol):
    """Chooses a demonstration and one of its steps."""

    def watch(self, steps: Sequence[Transition]) -> None:
        """Take note of a further demonstration."""
        ...

    def reset(self) -> None:
        """A new episode begins."""
        ...

    def route(self, query: Scene) -> tuple[int, int]:
        """Number of the demonstration and of its step that fit the query; asking changes nothing."""
        ...

    def took(self, demonstration: int, step: int) -> None:
        """The step was found in the scene and its action is being performed."""
        ...


class AdvancingRouter:
    """Goes through the first demonstration step by step and then stays at its last."""

    def __init__(self) -> None:
        self._length = 0
        self._next = 0

    def watch(self, steps: Sequence[Transition]) -> None:
        """Remember how many steps the first demonstration has."""
        self._length = self._length or len(steps)

    def reset(self) -> None:
        """Begin with the first step."""
        self._next = 0

    def route(self, query: Scene) -> tuple[int, int]:
        """The step after the one taken last."""
        return 0, self._next

    def took(self, demonstration: int, step: int) -> None:
        """The following step is next."""
        self._next = min(step + 1, self._length - 1)
