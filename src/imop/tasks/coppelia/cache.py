"""Models by their file's contents: what was unpacked once is kept in the user's folder for caches.

Unpacking takes nine tenths of reading a large model, so the cache holds bodies as they are: plain bytes,
which the reader trusts as little as the file itself.
"""

import hashlib
from pathlib import Path

from imop.errors import ModelFormatError
from imop.files import read, replaced, user_cache
from imop.tasks.coppelia.container import unpack
from imop.tasks.coppelia.model import Model
from imop.tasks.coppelia.reader import read_body


def load_model(path: Path, folder: Path | None = None) -> Model:
    """The model in a .ttm file, unpacked only once.

    Args:
        path: of the file.
        folder: of the cache; `user_cache()/models` if None.

    Raises:
        ModelFormatError: if it is not a readable model.
        CorruptData: if there is no such file, or git LFS left a pointer in its place.
    """
    data = read(path, "copy it again")
    digest = hashlib.sha256(data).hexdigest()
    return _load(digest, data, folder or user_cache() / "models")


def _load(digest: str, data: bytes, folder: Path) -> Model:
    kept = folder / f"{digest}.body"
    try:
        return read_body(kept.read_bytes())
    except (OSError, ModelFormatError):  # not there, or spoilt: made again
        body = unpack(data)
        model = read_body(body)
    try:
        with replaced(kept) as temporary:
            temporary.write_bytes(body)
    except OSError:  # a folder that cannot be written only costs time
        pass
    return model
