"""A step that one demonstration shows and another one asks for, and the pair that the networks see of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from imop.training.data.pairs import StepPair
from imop.types import Action, FloatArray, Observation


class AnyDemonstration(Protocol):
    """A demonstration, recorded or made."""

    @property
    def observations(self) -> Sequence[Observation]:
        """Before the first step, and after each."""
        ...

    @property
    def actions(self) -> Sequence[Action]:
        """What was done in each step."""
        ...


S = TypeVar("S", bound=AnyDemonstration, covariant=True)


@dataclass(frozen=True, eq=False)
class ExecutedStep(Generic[S]):
    """A step of a demonstration that has to be done in the state of another one.

    Attributes:
        pair: of the step.
        shown: the demonstration.
        asked: the execution that the query is of.
        step: its number.
    """

    pair: StepPair
    shown: S
    asked: S
    step: int

    def right_poses(self) -> FloatArray:
        """(S, 4, 4) where the gripper may go in the query."""
        return self.pair.T_query_support @ self.pair.T_world_goal


E = TypeVar("E", bound=ExecutedStep[AnyDemonstration])


def executions(examples: Sequence[E]) -> list[list[E]]:
    """The examples of a scene by demonstration and query, in the order of their steps."""
    groups: dict[tuple[int, int], list[E]] = {}
    for example in examples:
        groups.setdefault((id(example.shown), id(example.asked)), []).append(example)
    return list(groups.values())
