"""Files appear whole or not at all, and what cannot be read raises one kind of error."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from imop.errors import CorruptData, InvalidInput

_LFS_POINTER = b"version https://git-lfs.github.com/spec/v1"


def read(path: Path, remedy: str = "restore it or record it again") -> bytes:
    """The content of a file.

    Args:
        path: the file.
        remedy: what to do if it is missing.

    Raises:
        CorruptData: if it is missing or cannot be read, or git LFS left a pointer in its place.
    """
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise CorruptData(path, "the file is missing", remedy) from None
    except OSError as error:
        raise CorruptData(path, f"the file cannot be read ({error.strerror})", remedy) from error
    if content.startswith(_LFS_POINTER):
        raise CorruptData(path, "is a pointer of git LFS, not the file itself", "run `git lfs pull`")
    return content


@contextmanager
def replaced(path: Path) -> Iterator[Path]:
    """Yield a temporary name beside `path`; rename it to `path` if the block succeeds, else remove it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def writable_folder(folder: Path, field: str = "out") -> None:
    """Make a folder and see that files can be written into it, so that no work is done in vain.

    Args:
        folder: made with its parents if it does not exist.
        field: what the error calls it.

    Raises:
        InvalidInput: if it cannot be made or written into.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        accepted = "a folder that exists or can be made, and can be written into"
        raise InvalidInput(field, f"{folder}: {error.strerror}", accepted) from error


def user_cache() -> Path:
    """The user's folder for what can be made again."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "imop"
