"""The keyframes of a recorded folder: found once, then kept as a person has changed them."""

import json
from pathlib import Path

from imop.errors import CorruptData
from imop.files import read, replaced
from imop.recording.draft import Draft
from imop.recording.folder import KEYFRAMES, RecordedFolder, read_folder


def load_draft(folder: Path, recording: RecordedFolder | None = None) -> Draft:
    """A recording with its keyframes: those that were kept, or else those that are found.

    Args:
        folder: of the recording.
        recording: what was read of it, if it was.

    Raises:
        CorruptData: if the recording or its keyframes cannot be read.
        InvalidInput: for a field of them that cannot be.
    """
    source, path = recording or read_folder(folder), folder / KEYFRAMES
    if not path.exists():
        return Draft.of(source)
    try:
        return Draft(source, tuple(int(frame) for frame in json.loads(read(path))["frames"]))
    except (ValueError, KeyError, TypeError) as error:
        problem, remedy = f"does not name frames ({error})", "remove it; keyframes are then found anew"
        raise CorruptData(path, problem, remedy) from error


def save_draft(draft: Draft, folder: Path) -> None:
    """Keep the keyframes beside the recording."""
    with replaced(folder / KEYFRAMES) as temporary:
        temporary.write_text(json.dumps({"frames": list(draft.frames)}) + "\n")
