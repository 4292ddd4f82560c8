"""Demonstrations from whatever folder they lie in."""

from pathlib import Path

from imop.demos.rlbench import episodes, read_episode
from imop.demos.store import DemonstrationStore
from imop.errors import CorruptData, InvalidInput
from imop.types import Demonstration


def load_demonstrations(path: Path, count: int | None = None) -> list[Demonstration]:
    """The first `count` (or all) demonstrations of a store, or of a folder in RLBench's layout.

    Raises:
        CorruptData: if there is none, or one cannot be read.
        InvalidInput: if `path` is neither.
    """
    if (path / "zarr.json").is_file():
        store = DemonstrationStore.open(path)
        found = [store[i] for i in range(len(store) if count is None else min(count, len(store)))]
    else:
        found = [read_episode(episode) for episode in episodes(path)[:count]]
    if not found:
        raise CorruptData(path, "holds no demonstration", "record or import one into it")
    return found


def load_demonstration(path: Path, episode: int = 0) -> Demonstration:
    """One demonstration of a store, or of a folder in RLBench's layout, by its number; no other is read.

    Raises:
        CorruptData: if there is none, or it cannot be read.
        InvalidInput: if `path` is neither, or has no such episode.
    """
    in_store = (path / "zarr.json").is_file()
    known = DemonstrationStore.open(path) if in_store else episodes(path)
    if not len(known):
        raise CorruptData(path, "holds no demonstration", "record or import one into it")
    if not 0 <= episode < len(known):
        raise InvalidInput("episode", f"{episode}", f"0 .. {len(known) - 1} for {path}")
    found = known[episode]
    return read_episode(found) if isinstance(found, Path) else found
