"""Demonstrations from whatever folder they lie in."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from imop.demos.rlbench import episodes, read_episode
from imop.demos.store import DemonstrationStore
from imop.errors import CorruptData, InvalidInput
from imop.types import Demonstration, Observation


def load_demonstrations(
    path: Path, count: int | None = None, cameras: Sequence[str] | None = None
) -> list[Demonstration]:
    """The first `count` (or all) demonstrations of a store, or of a folder in RLBench's layout.

    Args:
        path: the store or folder.
        count: how many; all by default.
        cameras: which views to keep; by default all of a store, and of a folder as in `read_episode`.

    Raises:
        CorruptData: if there is none, one cannot be read or lacks one of `cameras`.
        InvalidInput: if `path` is neither.
    """
    known = _known(path)
    numbers = range(len(known) if count is None else min(count, len(known)))
    if not numbers:
        raise _nothing(path)
    return [_read(path, known[number], cameras) for number in numbers]


def load_demonstration(path: Path, episode: int = 0) -> Demonstration:
    """One demonstration of a store, or of a folder in RLBench's layout, by its number; no other is read.

    Raises:
        CorruptData: if there is none, or it cannot be read.
        InvalidInput: if `path` is neither, or has no such episode.
    """
    known = _known(path)
    if not len(known):
        raise _nothing(path)
    if not 0 <= episode < len(known):
        raise InvalidInput("episode", f"{episode}", f"0 .. {len(known) - 1} for {path}")
    return _read(path, known[episode], None)


def _known(path: Path) -> DemonstrationStore | list[Path]:
    """The episodes by number, none of them read yet."""
    return DemonstrationStore.open(path) if (path / "zarr.json").is_file() else episodes(path)


def _nothing(path: Path) -> CorruptData:
    return CorruptData(path, "holds no demonstration", "record or import one into it")


def _read(path: Path, found: Demonstration | Path, cameras: Sequence[str] | None) -> Demonstration:
    if isinstance(found, Path):
        return read_episode(found, cameras)
    return found if cameras is None else _with_cameras(path, found, cameras)


def _with_cameras(path: Path, demonstration: Demonstration, cameras: Sequence[str]) -> Demonstration:
    def seen(observation: Observation) -> Observation:
        missing = [camera for camera in cameras if camera not in observation.views]
        if missing:
            problem = f"there is no view of camera {', '.join(missing)}"
            raise CorruptData(path, problem, f"ask for those that are there: {', '.join(observation.views)}")
        return replace(observation, views={camera: observation.views[camera] for camera in cameras})

    steps = tuple(replace(k, observation=seen(k.observation)) for k in demonstration.keyframes)
    return replace(demonstration, keyframes=steps, final=seen(demonstration.final))
