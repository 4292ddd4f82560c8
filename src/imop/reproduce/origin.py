"""Which code, machine and networks a table was made with."""

import math
import os
import platform
import shutil
import subprocess
from functools import cache
from pathlib import Path

from safetensors import safe_open

import imop
from imop.baselines.policy import PARTS
from imop.evaluation.fingerprint import code_digest
from imop.networks.model import BUNDLED, WEIGHTS

_TRAINED = ("learned", "routed", "paper")


@cache
def code() -> str:
    """Digest of all of imop's source."""
    return code_digest(imop)


@cache
def commit() -> str:
    """The commit of imop's source, with "+" if a file differs; empty outside of a checkout."""
    folder, git = Path(str(imop.__file__)).parent, shutil.which("git")
    if git is None:
        return ""
    command = [git, "-C", str(folder), "describe", "--always", "--dirty=+", "--abbrev=7", "--exclude=*"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.stdout.strip()


def machine() -> str:
    """Processor and cores, such as "x86_64, 2 cores"."""
    return f"{platform.machine()}, {os.cpu_count()} cores"


def parameters(method: str, weights: str) -> int | None:
    """Numbers in all networks of a folder of weights.

    Args:
        method: that uses them.
        weights: the folder; the bundled one if empty.

    Returns:
        None for a method that has other networks or none, or if the file is not there.
    """
    folder = Path(weights) if weights else BUNDLED
    parts = PARTS.get(method, ("",) if method in _TRAINED else ())
    files = [folder / part / WEIGHTS for part in parts]
    if not files or not all(file.is_file() for file in files):
        return None
    return sum(_numbers(file) for file in files)


def _numbers(file: Path) -> int:
    with safe_open(file, "pt") as tensors:
        shapes: list[list[int]] = [tensors.get_slice(name).get_shape() for name in tensors.keys()]  # noqa: SIM118
    return sum(math.prod(shape) for shape in shapes)
