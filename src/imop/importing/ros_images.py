"""Images of ROS as arrays: sensor_msgs/Image and sensor_msgs/CompressedImage."""

import io
from typing import Any

import numpy as np
from PIL import Image

from imop.errors import CorruptData
from imop.types import ByteArray, Float32Array

COLORS = {"rgb8": (3, (0, 1, 2)), "bgr8": (3, (2, 1, 0)), "rgba8": (4, (0, 1, 2)), "bgra8": (4, (2, 1, 0))}
"""Encoding -> bytes of a pixel, and which of them are red, green and blue."""
DEPTHS = {"16UC1": np.uint16, "mono16": np.uint16, "32FC1": np.float32}
"""Encoding -> type of a pixel."""
SCALES = {"16UC1": 0.001, "mono16": 0.001, "32FC1": 1.0}
"""Encoding -> metres per unit, by REP 118."""
_HEADER = 12
"""Bytes before the PNG of a compressed depth image."""
_REMEDY = "record raw images, or images compressed as PNG or JPEG"


def encoding(message: Any) -> str:
    """What the pixels of a message are: an encoding of `COLORS` or `DEPTHS`, or another one."""
    if hasattr(message, "encoding"):
        return str(message.encoding)
    told = str(message.format)
    return told.split(";")[0].strip() if ";" in told else "bgr8"


def color_of(message: Any, where: str) -> ByteArray:
    """(H, W, 3) uint8.

    Raises:
        CorruptData: if it is no colour image, or damaged.
    """
    if not hasattr(message, "encoding"):
        return np.asarray(_decoded(bytes(message.data), where).convert("RGB"), np.uint8)
    if message.encoding not in COLORS:
        raise CorruptData(where, f"encoding {message.encoding}", f"record one of {', '.join(COLORS)}")
    channels, order = COLORS[message.encoding]
    rows = _rows(message, np.dtype(np.uint8), where)
    pixels = rows[:, : message.width * channels].reshape(message.height, message.width, channels)
    return np.ascontiguousarray(pixels[:, :, list(order)])


def depth_of(message: Any, where: str) -> Float32Array:
    """(H, W) float32, in the units of the encoding.

    Raises:
        CorruptData: if it is no depth image, or damaged.
    """
    known = encoding(message)
    if known not in DEPTHS:
        raise CorruptData(where, f"encoding {known}", f"record one of {', '.join(DEPTHS)}")
    if not hasattr(message, "encoding"):
        if known == "32FC1":
            raise CorruptData(where, "compressed depth of floats", "record raw depth, or 16UC1")
        data = bytes(message.data)
        return np.asarray(_decoded(data[_HEADER:] if data[1:4] != b"PNG" else data, where), np.float32)
    kind = np.dtype(DEPTHS[known])
    rows = _rows(message, kind.newbyteorder(">" if message.is_bigendian else "<"), where)
    return np.asarray(rows[:, : message.width], np.float32)


def _rows(message: Any, kind: Any, where: str) -> Any:
    data = np.asarray(message.data, np.uint8)
    if len(data) < message.step * message.height or message.step % kind.itemsize:
        problem = f"{len(data)} bytes are not {message.height} rows of {message.step} bytes"
        raise CorruptData(where, problem, _REMEDY)
    return data[: message.step * message.height].view(kind).reshape(message.height, -1)


def _decoded(data: bytes, where: str) -> Image.Image:
    try:
        with Image.open(io.BytesIO(data)) as image:
            image.load()
            return image.copy()
    except Exception as error:  # a damaged image can fail in any way at all
        problem = f"an image cannot be read ({type(error).__name__}: {error})"
        raise CorruptData(where, problem, _REMEDY) from error
