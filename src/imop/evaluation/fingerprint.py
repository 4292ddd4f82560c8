"""Short digests of code and weights, so that results of another state are not taken for those of this one."""

import hashlib
from pathlib import Path
from types import ModuleType

from imop.networks.model import WEIGHTS


def code_digest(*packages: ModuleType) -> str:
    """Of the source files of packages."""
    digest = hashlib.sha256()
    for package in packages:
        for folder in package.__path__:
            for file in sorted(Path(folder).rglob("*.py")):
                digest.update(file.read_bytes())
    return digest.hexdigest()[:12]


def weights_digest(folder: Path) -> str:
    """Of the weights in a folder; of nothing if there are none."""
    file = folder / WEIGHTS
    return hashlib.sha256(file.read_bytes() if file.is_file() else b"").hexdigest()[:12]
