"""The episodes that lie somewhere, in any of the layouts."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Literal

from imop.errors import InvalidInput
from imop.importing.side import Side, read_side
from imop.recording.folder import RecordedFolder, is_recording, read_folder
from imop.recording.source import Source
from imop.setup.file import load_setup


def find_sources(
    layout: Literal["rosbag", "lerobot", "folder"],
    source: Path,
    side: Path | None = None,
    setup: Path | None = None,
) -> list[Source]:
    """All episodes of a recording, with what the side file and the set-up say about them.

    Args:
        layout: how they are laid out.
        source: an episode, a dataset, or a folder of episodes.
        side: file that says what they lack.
        setup: file of the cell.

    Raises:
        CorruptData: for a file that cannot be read.
        InvalidInput: if there is no episode, or for the first thing that nothing says.
        MissingExtra: without what reads the layout.
    """
    known = read_side(side, None if setup is None else load_setup(setup))
    if layout == "lerobot":
        from imop.importing.lerobot import read_dataset

        return list(read_dataset(source, known))
    if layout == "rosbag":
        from imop.importing.rosbag import read_bag

        return [read_bag(path, known) for path in _below(source, _is_bag, "a bag of ROS")]
    folders = _below(source, is_recording, "a recording.json")
    return [_with_side(read_folder(path), known) for path in folders]


def _below(source: Path, is_one: Callable[[Path], bool], what: str) -> list[Path]:
    found = [source] if is_one(source) else []
    if not found and source.is_dir():
        found = [path for path in sorted(source.iterdir()) if is_one(path)]
    if not found:
        raise InvalidInput("source", f"{source} holds no episode", f"{what}, or a folder of such")
    return found


def _is_bag(path: Path) -> bool:
    if path.is_dir():
        return (path / "metadata.yaml").is_file()
    return path.is_file() and path.suffix in (".mcap", ".db3", ".bag")


def _with_side(recording: RecordedFolder, side: Side) -> RecordedFolder:
    side.require_names(recording.cameras)
    cameras = {name: side.camera(name, camera) for name, camera in recording.cameras.items()}
    return replace(recording, cameras=cameras)
