"""What a demonstration is made of: frames of a recording, wherever they lie."""

from typing import Protocol

from imop.recording.motion import Motion
from imop.types import Observation


class Source(Protocol):
    """A recorded episode, whose images are read when they are asked for."""

    @property
    def name(self) -> str:
        """What messages call it."""
        ...

    @property
    def motion(self) -> Motion:
        """What the arm did."""
        ...

    @property
    def task(self) -> str:
        """For bookkeeping; may be empty."""
        ...

    @property
    def instructions(self) -> tuple[str, ...]:
        """The task in words, if somebody said it."""
        ...

    def observation(self, frame: int, time_step: int = 0) -> Observation:
        """What was seen in a frame.

        Raises:
            CorruptData: if an image is missing or damaged.
            InvalidInput: if intrinsics, a camera's pose or the scale of its depth are missing; it is named.
        """
        ...
