"""Image files of a recording: PNG and JPEG, and arrays in NPY and NPZ files."""

from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from imop.errors import CorruptData
from imop.files import replaced
from imop.types import ByteArray, Float32Array

DEPTH_STEP = 0.0001
"""Metres per step of the depth images that are written here; the farthest is 6.55 m."""
_FARTHEST = 65535
_REMEDY = "restore it, or leave the frame out"


def write_color(path: Path, rgb: ByteArray) -> None:
    """Write (H, W, 3) uint8 as PNG; quickly, not as small as possible."""
    with replaced(path) as temporary:
        Image.fromarray(rgb).save(temporary, format="PNG", compress_level=1)


def write_depth(path: Path, depth: Float32Array) -> None:
    """Write (H, W) metres as 16 bit PNG in steps of `DEPTH_STEP`; what is farther than 6.55 m is 0."""
    steps = np.round(np.nan_to_num(depth / DEPTH_STEP, nan=0.0, posinf=0.0, neginf=0.0))
    steps[(steps < 0) | (steps > _FARTHEST)] = 0
    with replaced(path) as temporary:
        Image.fromarray(steps.astype(np.uint16)).save(temporary, format="PNG", compress_level=1)


def read_color(folder: Path, name: str, frame: int) -> ByteArray:
    """(H, W, 3) uint8.

    Args:
        folder: of the recording.
        name: a PNG or JPEG file, an .npy file, or "file.npz:array". An array of more images than one has one
            for each frame.
        frame: number of the frame.

    Raises:
        CorruptData: if it is missing, damaged, or no 8 bit colour image.
    """
    image: ByteArray = _read(folder, name, frame, 3)
    if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3:
        problem = f"{image.dtype} of shape {image.shape}"
        raise CorruptData(folder / name, problem, "give red, green and blue of 8 bit, (H, W, 3)")
    return image


def read_depth(folder: Path, name: str, frame: int) -> Float32Array:
    """(H, W) float32, in the units of the file.

    Args:
        folder: of the recording.
        name: as in `read_color`.
        frame: number of the frame.

    Raises:
        CorruptData: if it is missing, damaged, or has more than one channel or 8 bits.
    """
    image = _read(folder, name, frame, 2)
    if image.ndim == 3 and image.shape[2] == 1:
        image = image[:, :, 0]
    if image.ndim != 2 or image.dtype == np.uint8 or image.dtype.kind not in "uif":
        problem = f"{image.dtype} of shape {image.shape}"
        raise CorruptData(folder / name, problem, "give one channel of 16 bit, or of floats, (H, W)")
    values: Float32Array = image.astype(np.float32)
    return values


def _read(folder: Path, name: str, frame: int, axes: int) -> Any:
    file, _, key = name.partition(":")
    path = folder / file
    if not path.is_file():
        raise CorruptData(path, "the file is missing", _REMEDY)
    try:
        if path.suffix == ".npz":
            with np.load(path, allow_pickle=False) as arrays:
                if key not in arrays:
                    remedy = f"name one of its arrays: {', '.join(f'{file}:{n}' for n in arrays)}"
                    raise CorruptData(path, f"holds no array {key!r}", remedy)
                found = arrays[key]
        elif path.suffix == ".npy":
            found = np.load(path, allow_pickle=False)
        else:
            with Image.open(path) as image:
                return np.asarray(image if image.mode not in ("P", "RGBA", "CMYK") else image.convert("RGB"))
    except CorruptData:
        raise
    except Exception as error:  # a damaged file can fail in any way at all
        raise CorruptData(path, f"cannot be read ({type(error).__name__}: {error})", _REMEDY) from error
    stacked = found.ndim > axes and not (axes == 2 and found.ndim == 3 and found.shape[2] == 1)
    if not stacked:
        return found
    if frame >= len(found):
        raise CorruptData(path, f"has {len(found)} images, but frame {frame} is asked for", _REMEDY)
    return found[frame]
