"""RLBench's PNG images: colours, depth in 24 bits, object handles."""

import struct
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image

from imop.errors import CorruptData
from imop.files import read
from imop.types import ByteArray, Float32Array, IntArray

MOST_PIXELS = 7680 * 4320
"""More than any depth camera has; decoding as many takes 0.1 GB."""

_FAR_CODE = 2**24 - 1
# No room measures more than 65 m; as a fraction this is 0.4 % of the way from the near to the far plane.
_MILLIMETRES = 2**16
_SIGNATURE = b"\x89PNG\r\n\x1a\n"
# No deflated byte stands for more.
_MOST_PER_BYTE = 1032


def read_rgb(path: Path) -> ByteArray:
    """(H, W, 3) uint8.

    Raises:
        CorruptData: if the file is missing, damaged, larger than `MOST_PIXELS`, or not an 8 bit RGB image.
    """
    content = read(path, "restore it: frame 0 and every keyframe are needed")
    _check_header(path, content)
    try:
        with Image.open(BytesIO(content), formats=["PNG"]) as image:
            image.verify()  # decoding alone overlooks damage; it also uses the image up
        with Image.open(BytesIO(content), formats=["PNG"]) as image:
            mode, pixels = image.mode, np.array(image)
    except Exception as error:  # a damaged image can fail in any way at all
        raise CorruptData(path, f"not a readable image ({type(error).__name__}: {error})") from error
    if mode != "RGB":
        raise CorruptData(path, f"an image of mode {mode}, not 8 bit RGB")
    return pixels


def _check_header(path: Path, content: bytes) -> None:
    """The size is believed only if it is possible, for decoding takes the memory at once."""
    if content[:8] != _SIGNATURE or content[12:16] != b"IHDR" or len(content) < 24:
        raise CorruptData(path, "not a readable image (it does not begin as PNG does)")
    width, height = struct.unpack(">II", content[16:24])
    if width * height > MOST_PIXELS:
        problem = f"an image of {width} x {height} pixels; at most {MOST_PIXELS} are read"
        raise CorruptData(path, problem, "record it with a smaller camera")
    if 3 * width * height > _MOST_PER_BYTE * len(content) or b"IDAT" not in content:
        problem = f"not a readable image ({width} x {height} pixels are not in {len(content)} bytes)"
        raise CorruptData(path, problem)


def read_depth(path: Path, near: float, far: float) -> Float32Array:
    """(H, W) metres along the optical axis; 0 where the camera saw nothing up to its far plane.

    Args:
        path: PNG whose red, green and blue are the bytes, highest first, of the fraction between the planes.
        near: near clipping plane, metres.
        far: far clipping plane, metres.

    Raises:
        CorruptData: as `read_rgb`, and if the codes are millimetres instead of fractions.
    """
    r, g, b = np.moveaxis(read_rgb(path).astype(np.int64), -1, 0)
    code = r * 65536 + g * 256 + b
    if np.any(code != _FAR_CODE) and code[code != _FAR_CODE].max() < _MILLIMETRES:
        problem = f"no depth code is above {_MILLIMETRES}: they look like millimetres"
        raise CorruptData(path, problem, f"code the fraction between the clipping planes, 0 .. {_FAR_CODE}")
    depth = near + code / _FAR_CODE * (far - near)
    return np.where(code == _FAR_CODE, 0.0, depth).astype(np.float32)


def read_ids(path: Path) -> IntArray:
    """(H, W) int32 handle of the object seen in each pixel.

    Raises:
        CorruptData: as `read_rgb`.
    """
    # Widened first: in numpy 2 a uint8 times 256 overflows.
    r, g, b = np.moveaxis(read_rgb(path).astype(np.int32), -1, 0)
    ids: IntArray = r + 256 * g + 65536 * b
    return ids
