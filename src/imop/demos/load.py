"""Demonstrations from whatever folder they lie in."""

from pathlib import Path

from imop.demos.rlbench import episodes, read_episode
from imop.demos.store import DemonstrationStore
from imop.errors import CorruptData
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
