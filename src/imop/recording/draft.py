"""A demonstration in the making: a recording and its keyframes, which a person may change."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from imop.errors import InvalidInput
from imop.geometry.se3 import translation_distance
from imop.recording.source import Source
from imop.types import Action, BoolArray, Demonstration, Keyframe

FAR = 0.15
"""Metres; shorter ways belong to what is done at one place."""
EMPTY = 0.05
"""Below this opening the fingers hold nothing."""


@dataclass(frozen=True, eq=False)
class Draft:
    """A recording with its keyframes.

    Number 0 is where the demonstration begins, numbers 1 .. K are where its K actions ended. What is seen in
    one is what the next action was decided on.

    Attributes:
        source: the recording.
        frames: (K + 1) increasing frame numbers, at least two.

    Raises:
        InvalidInput: for frames that do not increase, that the recording lacks, or fewer than two.
    """

    source: Source
    frames: tuple[int, ...]

    def __post_init__(self) -> None:
        frames, n = tuple(int(frame) for frame in self.frames), len(self.source.motion)
        if len(frames) < 2:
            raise InvalidInput("keyframes", f"{len(frames)} of them", "a beginning and at least one more")
        if frames[0] < 0 or frames[-1] >= n or np.any(np.diff(frames) <= 0):
            accepted = f"each later than the one before, frames 0 .. {n - 1}"
            raise InvalidInput("keyframes", f"frames {', '.join(map(str, frames))}", accepted)
        object.__setattr__(self, "frames", frames)

    @classmethod
    def of(cls, source: Source) -> Self:
        """A recording with the keyframes that are found in it."""
        return cls(source, (0, *source.motion.find_keyframes()))

    def moved(self, number: int, frame: int) -> Self:
        """The same with keyframe `number` at another frame.

        Raises:
            InvalidInput: if there is no such keyframe, or it would not be between its neighbours.
        """
        self._require(number)
        return replace(self, frames=(*self.frames[:number], frame, *self.frames[number + 1 :]))

    def added(self, frame: int) -> Self:
        """The same with one more keyframe.

        Raises:
            InvalidInput: if there is one in that frame, or no such frame.
        """
        if frame in self.frames:
            raise InvalidInput("keyframes", f"there is one in frame {frame}", "another frame")
        return replace(self, frames=tuple(sorted((*self.frames, frame))))

    def removed(self, number: int) -> Self:
        """The same without keyframe `number`.

        Raises:
            InvalidInput: if there is no such keyframe, or it is the beginning, which can only be moved.
        """
        self._require(number)
        if number == 0:
            raise InvalidInput("keyframes", "number 0 is the beginning", "moving it, or removing another")
        return replace(self, frames=(*self.frames[:number], *self.frames[number + 1 :]))

    def _require(self, number: int) -> None:
        if not 0 <= number < len(self.frames):
            raise InvalidInput("keyframes", f"no number {number}", f"0 .. {len(self.frames) - 1}")

    @property
    def gripper_open(self) -> BoolArray:
        """(K + 1,) state of the gripper at each keyframe."""
        return np.asarray(self.source.motion.gripper_open[list(self.frames)])

    @property
    def may_touch(self) -> BoolArray:
        """(K,) whether each action may touch things; a recording does not say it.

        What is far and neither begins nor ends with fingers that move is taken for a way through the air, on
        which a planner shall avoid things. Closed fingers that hold nothing are there to push or press.
        """
        motion, at, is_open = self.source.motion, list(self.frames), self.gripper_open
        way = translation_distance(motion.T_world_gripper[at[:-1]], motion.T_world_gripper[at[1:]])
        changes = np.concatenate([[False], is_open[1:] != is_open[:-1]])
        fist = motion.gripper_opening[at] < EMPTY
        return np.asarray((way < FAR) | changes[:-1] | changes[1:] | (fist[:-1] & fist[1:]))

    def demonstration(self) -> Demonstration:
        """The demonstration: for each action the pose that was reached and the state of the gripper there.

        Raises:
            CorruptData, InvalidInput: as `Source.observation`.
        """
        seen = [self.source.observation(frame, number) for number, frame in enumerate(self.frames)]
        actions = [
            Action(after.T_world_gripper, is_open, touches)
            for after, is_open, touches in zip(
                seen[1:], self.gripper_open[1:].tolist(), self.may_touch.tolist(), strict=True
            )
        ]
        steps = tuple(Keyframe(before, action) for before, action in zip(seen[:-1], actions, strict=True))
        return Demonstration(steps, seen[-1], self.source.task, instructions=self.source.instructions)
