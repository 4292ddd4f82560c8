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
        """Number of the demonstration and of its step that fit the query."""
        ...


class AdvancingRouter:
    """Goes through the first demonstration step by step and then stays at its last."""

    def __init__(self) -> None:
        self._lengths: list[int] = []
        self._next = 0

    def watch(self, steps: Sequence[Transition]) -> None:
        """Remember how many steps there are."""
        self._lengths.append(len(steps))

    def reset(self) -> None:
        """Begin with the first step."""
        self._next = 0

    def route(self, query: Scene) -> tuple[int, int]:
        """The step after the one given last."""
        step = min(self._next, self._lengths[0] - 1)
        self._next = step + 1
        return 0, step
