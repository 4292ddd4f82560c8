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
from imop.baselines.policy import FOLDER, PARTS
from imop.evaluation.fingerprint import code_digest
from imop.networks.model import BUNDLED, WEIGHTS

_TRAINED = ("learned", "advancing", "paper")


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


def weight_files(method: str, weights: Path | None) -> list[Path]:
    """The files of the networks that a method uses; none for one without networks.

    Args:
        method: its name.
        weights: the folder; None for the method's usual one.
    """
    if method in PARTS:
        return [(weights or FOLDER) / part / WEIGHTS for part in PARTS[method]]
    return [(weights or BUNDLED) / WEIGHTS] if method in _TRAINED else []


def parameters(method: str, weights: Path | None) -> int | None:
    """Numbers in all networks of `weight_files`; None if there are none, or one is not there."""
    files = weight_files(method, weights)
    return sum(map(_numbers, files)) if files and all(file.is_file() for file in files) else None


def _numbers(file: Path) -> int:
    with safe_open(file, "pt") as tensors:
        shapes: list[list[int]] = [tensors.get_slice(name).get_shape() for name in tensors.keys()]  # noqa: SIM118
    return sum(math.prod(shape) for shape in shapes)
