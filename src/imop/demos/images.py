"""RLBench's PNG images: colours, depth in 24 bits, object handles."""

from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError

from imop.errors import CorruptData
from imop.types import ByteArray, Float32Array, IntArray

_FAR_CODE = 2**24 - 1


def read_rgb(path: Path) -> ByteArray:
    """(H, W, 3) uint8.

    Raises:
        CorruptData: if the file is missing, damaged or not an 8 bit RGB image.
    """
    try:
        content = BytesIO(path.read_bytes())
        with Image.open(content) as image:
            image.verify()  # decoding alone overlooks damage; it also uses the image up
        with Image.open(content) as image:
            mode, pixels = image.mode, np.array(image)
    except FileNotFoundError:
        remedy = "restore it: frame 0 and every keyframe are needed"
        raise CorruptData(path, "the image of a needed frame is missing", remedy) from None
    except (OSError, SyntaxError, ValueError, UnidentifiedImageError) as error:
        raise CorruptData(path, f"not a readable image ({error})") from error
    if mode != "RGB":
        raise CorruptData(path, f"an image of mode {mode}, not 8 bit RGB")
    return pixels


def read_depth(path: Path, near: float, far: float) -> Float32Array:
    """(H, W) metres along the optical axis; 0 where the camera saw nothing up to its far plane.

    Args:
        path: PNG whose red, green and blue are the bytes, highest first, of the fraction between the planes.
        near: near clipping plane, metres.
        far: far clipping plane, metres.

    Raises:
        CorruptData: as `read_rgb`.
    """
    r, g, b = np.moveaxis(read_rgb(path).astype(np.int64), -1, 0)
    code = r * 65536 + g * 256 + b
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
