"""What a person types to change keyframes: numbers as in the table, frames as numbers or in seconds."""

import re
from collections.abc import Sequence

import numpy as np

from imop.errors import InvalidInput
from imop.recording.draft import Draft
from imop.types import FloatArray

_MOVE = re.compile(r"(\d+)\s*[: ]\s*([+-]?)(\d+(?:\.\d+)?s|\d+)")
_FRAME = re.compile(r"\d+(?:\.\d+)?s|\d+")


def edited(draft: Draft, move: Sequence[str], add: Sequence[str], remove: Sequence[int]) -> Draft:
    """The draft with changes, whose numbers are all those of the draft as it is.

    Args:
        draft: the draft.
        move: "2:37" puts keyframe 2 into frame 37, "2:+5" moves it by five frames, "2:4.2s" to 4.2 seconds
            after the recording began, "2:-0.4s" by as much.
        add: "40" makes frame 40 a keyframe, "4.2s" the frame at that time.
        remove: numbers of keyframes.

    Raises:
        InvalidInput: for what is none of these, or cannot be done.
    """
    frames = dict(enumerate(draft.frames))
    for one in move:
        number, frame = _moved(draft, one)
        frames[number] = frame
    for number in remove:
        draft.removed(number)  # refuses what cannot be removed
        frames.pop(number, None)
    moved = Draft(draft.source, tuple(frames.values()))
    for one in add:
        moved = moved.added(_frame(draft, one))
    return moved


def _moved(draft: Draft, text: str) -> tuple[int, int]:
    found = _MOVE.fullmatch(text.strip())
    if found is None:
        accepted = "number:frame, number:+frames or number:-frames, such as 2:+5; or with seconds, 2:-0.4s"
        raise InvalidInput("move", repr(text), accepted)
    number, sign = int(found[1]), found[2]
    if number >= len(draft.frames):
        raise InvalidInput("move", f"no keyframe {number}", f"0 .. {len(draft.frames) - 1}")
    if not sign:
        return number, _frame(draft, found[3])
    here, times = draft.frames[number], draft.source.motion.times
    if found[3].endswith("s"):
        return number, _nearest(times, times[here] + float(f"{sign}{found[3][:-1]}"))
    return number, here + int(f"{sign}{found[3]}")


def _frame(draft: Draft, text: str) -> int:
    if _FRAME.fullmatch(text.strip()) is None:
        raise InvalidInput("add", repr(text), "a frame, such as 40, or a time, such as 4.2s")
    if not text.strip().endswith("s"):
        return int(text)
    times = draft.source.motion.times
    return _nearest(times, times[0] + float(text.strip()[:-1]))


def _nearest(times: FloatArray, time: float) -> int:
    return int(np.argmin(np.abs(times - time)))
