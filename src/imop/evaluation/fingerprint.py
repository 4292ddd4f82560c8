"""Short digests of code and weights, so that results of another state are not taken for those of this one."""

import hashlib
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

from imop.networks.model import WEIGHTS


def code_digest(*modules: ModuleType) -> str:
    """Of the source files of packages, and of single modules."""
    digest = hashlib.sha256()
    for module in modules:
        folders = [Path(folder) for folder in getattr(module, "__path__", ())]
        files = [file for folder in folders for file in sorted(folder.rglob("*.py"))]
        for file in files or [Path(str(module.__file__))]:
            digest.update(file.read_bytes())
    return digest.hexdigest()[:12]


def own_code_digest(*made: Any) -> list[str]:
    """Of the modules outside imop that define classes and what they inherit, or functions; none, no digest.

    A module within a package stands for the whole package, for it may use the rest of it.
    """
    kinds = [kind for each in made for kind in getattr(each, "__mro__", (each,))]
    names = {getattr(kind, "__module__", "builtins").partition(".")[0] for kind in kinds}
    modules = [sys.modules[name] for name in sorted(names - {"imop"} - sys.stdlib_module_names)]
    digest = hashlib.sha256()
    for module in modules:
        if hasattr(module, "__path__"):
            digest.update(code_digest(module).encode())
        elif module.__file__:
            digest.update(Path(module.__file__).read_bytes())
    return [digest.hexdigest()[:12]] if modules else []


def weights_digest(folder: Path) -> str:
    """Of the weights in a folder; of nothing if there are none."""
    file = folder / WEIGHTS
    return hashlib.sha256(file.read_bytes() if file.is_file() else b"").hexdigest()[:12]
