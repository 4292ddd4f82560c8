"""Where the tasks' model files are kept: copies in the user's cache, unpacked once."""

import shutil
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from imop.errors import AssetMissing, CorruptData, InvalidInput, MissingExtra, ModelFormatError
from imop.files import replaced, user_cache
from imop.tasks.coppelia.cache import load_model
from imop.tasks.coppelia.lacks import lacks
from imop.tasks.coppelia.model import Model, Shape
from imop.tasks.coppelia.parts import convex_parts, is_convex
from imop.tasks.rlbench.waypoints import numbered

SOURCE = "https://github.com/stepjam/RLBench (or the fork of PerAct), folder rlbench/task_ttms"
COMMAND = "imop assets rlbench --from PATH"


def folder() -> Path:
    """Where the copies are."""
    return user_cache() / "rlbench"


def available(file: str) -> bool:
    """Whether the model `file`, such as open_drawer, was installed."""
    return (folder() / f"{file}.ttm").is_file()


def load(file: str) -> Model:
    """The model of a task.

    Raises:
        AssetMissing: if it was not installed.
        CorruptData, ModelFormatError: if the installed file is broken.
    """
    path = folder() / f"{file}.ttm"
    if not path.is_file():
        raise AssetMissing(f"{file}.ttm", f"{COMMAND} (PATH: a copy of {SOURCE})")
    return _load(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=8)
def _load(path: Path, _changed: int) -> Model:
    return load_model(path)


def find(source: Path) -> dict[str, Path]:
    """File name without .ttm -> file, of all models anywhere below a folder.

    Raises:
        InvalidInput: if it is no folder, or there are none.
    """
    if not source.is_dir():
        raise InvalidInput("from", f"{source} is no folder", f"a copy of {SOURCE}")
    paths = (path for path in sorted(source.rglob("*.ttm"), reverse=True) if path.is_file())
    found = {path.stem: path for path in paths}
    if not found:
        raise InvalidInput("from", f"no .ttm file below {source}", f"a copy of {SOURCE}")
    return found


@dataclass(frozen=True)
class Installed:
    """What became of a file.

    Attributes:
        error: why it cannot be read; it was not copied then.
        lacks: what of it will not be as in the program.
    """

    error: str = ""
    lacks: tuple[str, ...] = ()


def install(source: Path, known: Collection[str] = ()) -> dict[str, Installed]:
    """Copy all model files that can be read into the user's cache and unpack them there.

    Args:
        source: a folder, searched with all below it.
        known: names without .ttm of models whose tasks are written: these deal with what the models lack.

    Returns:
        What became of every file, by its name without .ttm.

    Raises:
        InvalidInput: if `source` is no folder, or has no models.
    """
    done = {}
    for file, path in find(source).items():
        try:
            model = load_model(path)
        except (CorruptData, ModelFormatError) as error:
            done[file] = Installed(error=str(error))
            continue
        with replaced(folder() / f"{file}.ttm") as temporary:
            shutil.copyfile(path, temporary)
        done[file] = Installed()
        if file not in known:
            _take_apart(model)
            waypoints = [] if numbered(model) else ["there is no waypoint0: say the expert's steps yourself"]
            done[file] = Installed(lacks=(*lacks(model), *waypoints))
    return done


def _take_apart(model: Model) -> None:
    """Make and keep the convex parts now, so that no scene waits for them."""
    solid = (o for o in model.objects if isinstance(o, Shape) and o.respondable)
    pieces = [piece for o in solid for piece in o.pieces if not is_convex(piece)]
    with suppress(MissingExtra):  # said when a scene is made of it
        for piece in pieces:
            convex_parts(piece)
