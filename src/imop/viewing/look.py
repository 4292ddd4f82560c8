"""What there is to see of one decision."""

from dataclasses import dataclass, replace

from imop.errors import InvalidInput
from imop.policy.interfaces import Scene
from imop.types import Action, FloatArray


@dataclass(frozen=True, eq=False)
class Shown:
    """The demonstrated step that a decision transfers.

    Attributes:
        step: its number.
        scene: the demonstrated state.
        actions: of all steps of the demonstration.
        spread: (M,) metres, for each point of the region how far from it its counterpart on another thing may
            be (`PreparedStep.spread`); None if nothing is known.
    """

    step: int
    scene: Scene
    actions: tuple[Action, ...]
    spread: FloatArray | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.step < len(self.actions):
            raise InvalidInput("step", f"{self.step}", f"0 .. {len(self.actions) - 1}")

    @property
    def action(self) -> Action:
        """What was demonstrated."""
        return self.actions[self.step]


@dataclass(frozen=True, eq=False)
class Look:
    """One decision to look at.

    Attributes:
        scene: what was seen, and of it what was said to be meant.
        choices: actions that may be meant, likeliest first, each with its match; none if `problem` says why.
        shown: what they were carried over from; None if that is not known.
        ways: for each choice, the way (K, 3) of the tip to it, metres; None where no motion is known.
        known: (4, 4) where the gripper is known to have gone from here, in a recording.
        chosen: number of the choice that is looked at.
        problem: why there is no choice, or why it cannot be done.
    """

    scene: Scene
    choices: tuple[Action, ...] = ()
    shown: Shown | None = None
    ways: tuple[FloatArray | None, ...] = ()
    known: FloatArray | None = None
    chosen: int = 0
    problem: str = ""

    @property
    def action(self) -> Action | None:
        """The choice that is looked at; None if there is none."""
        return self.choices[self.chosen] if self.choices else None

    @property
    def way(self) -> FloatArray | None:
        """(K, 3) of the tip to the choice, metres; None if it is not known."""
        return self.ways[self.chosen] if self.chosen < len(self.ways) else None

    def choose(self, number: int) -> "Look":
        """The same, looking at another choice.

        Raises:
            InvalidInput: if there is none of that number.
        """
        if not 0 <= number < len(self.choices):
            raise InvalidInput("choice", f"{number}", f"0 .. {len(self.choices) - 1}")
        return replace(self, chosen=number)
