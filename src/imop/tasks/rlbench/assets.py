"""Where the tasks' model files are kept: copies in the user's cache, unpacked once."""

import shutil
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path

from imop.errors import AssetMissing, InvalidInput, ModelFormatError
from imop.files import replaced, user_cache
from imop.tasks.coppelia.cache import load_model
from imop.tasks.coppelia.model import Model

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
        ModelFormatError: if the installed file is broken.
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
    found = {path.stem: path for path in sorted(source.rglob("*.ttm"), reverse=True)}
    if not found:
        raise InvalidInput("from", f"no .ttm file below {source}", f"a copy of {SOURCE}")
    return found


def install(source: Path, files: Iterable[str]) -> dict[str, str]:
    """Copy model files into the user's cache and unpack them there.

    Args:
        source: a folder, searched with all below it.
        files: names without .ttm of the models that are wanted.

    Returns:
        File name -> what is wrong with it, or nothing; files that were not found are left out.

    Raises:
        InvalidInput: if `source` is no folder, or has no models.
    """
    found, problems = find(source), {}
    for file in files:
        if file in found:
            try:
                load_model(found[file])
            except ModelFormatError as error:
                problems[file] = str(error)
                continue
            with replaced(folder() / f"{file}.ttm") as temporary:
                shutil.copyfile(found[file], temporary)
            problems[file] = ""
    return problems
