"""Messages of openpi's protocol: msgpack, in which a numpy array is a map of its bytes, type and shape.

An array is {b"__ndarray__": True, b"data": bytes, b"dtype": str, b"shape": [int]}, a numpy scalar
{b"__npgeneric__": True, b"data": number, b"dtype": str}; the types are written as numpy's `dtype.str`.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from imop.errors import InvalidInput
from imop.extras import extra

with extra("serve"):
    import msgpack

# What a message may hold at most: axes of an array, elements of a list, entries of a map.
AXES, ELEMENTS, ENTRIES = 4, 10_000, 1_000
_NUMBERS = "bool, integers or floats of at most 8 bytes"
_MESSAGE = "one msgpack message of maps, lists, strings, numbers and numpy arrays"


def pack(value: Any) -> bytes:
    """A message of dicts, lists, strings, numbers and numpy arrays.

    Raises:
        InvalidInput: if it holds anything else.
    """
    try:
        packed: bytes = msgpack.packb(value, default=_plain)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInput("message", f"cannot be packed ({error})", _MESSAGE) from error
    return packed


def unpack(message: bytes | bytearray) -> Any:
    """What a message holds; its arrays are read-only and share its memory.

    Raises:
        InvalidInput: if it is no such message, is cut off, or holds too much.
    """
    try:
        return msgpack.unpackb(
            message,
            object_hook=_number_or_array,
            ext_hook=_no_extension,
            max_array_len=ELEMENTS,
            max_map_len=ENTRIES,
        )
    except InvalidInput:
        raise
    # What is nested too deeply, has a wrong key, is no text or ends too early: each fails in its own way.
    except (ValueError, TypeError, OverflowError, RecursionError) as error:
        raise InvalidInput(
            "message", f"cannot be read ({type(error).__name__}: {error})", _MESSAGE
        ) from error


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        _check_type(value.dtype)
    if isinstance(value, np.ndarray):
        return {
            b"__ndarray__": True,
            b"data": value.tobytes(),
            b"dtype": value.dtype.str,
            b"shape": value.shape,
        }
    if isinstance(value, np.generic):
        return {b"__npgeneric__": True, b"data": value.item(), b"dtype": value.dtype.str}
    raise TypeError(f"a {type(value).__name__}")


def _number_or_array(fields: dict[Any, Any]) -> Any:
    if b"__ndarray__" in fields:
        return _array(_type_of(fields), fields.get(b"data"), fields.get(b"shape"))
    if b"__npgeneric__" in fields:
        number = fields.get(b"data")
        if not isinstance(number, bool | int | float):
            raise InvalidInput("message", f"a numpy scalar with data {_short(number)}", "a number")
        return _type_of(fields).type(number)
    return fields


def _type_of(fields: dict[Any, Any]) -> np.dtype[Any]:
    name = fields.get(b"dtype")
    try:
        # Not whatever numpy makes a type of: None would be float64, and commas make records.
        dtype = np.dtype(name) if isinstance(name, str) else None
    except (TypeError, ValueError, SyntaxError):
        dtype = None
    if dtype is None:
        raise InvalidInput("message", f"dtype {_short(name)}", _NUMBERS)
    _check_type(dtype)
    return dtype


def _check_type(dtype: np.dtype[Any]) -> None:
    if dtype.kind not in "biuf" or dtype.itemsize > 8 or dtype.subdtype is not None:
        raise InvalidInput("message", f"dtype {_short(dtype)}", _NUMBERS)


def _array(dtype: np.dtype[Any], data: Any, shape: Any) -> NDArray[Any]:
    if not (isinstance(shape, list) and len(shape) <= AXES):
        raise InvalidInput(
            "message", f"an array of shape {_short(shape)}", f"a list of at most {AXES} lengths"
        )
    if not all(type(n) is int and 0 <= n < 2**31 for n in shape):
        raise InvalidInput("message", f"an array of shape {_short(shape)}", "lengths from 0 on")
    size = math.prod(shape) * dtype.itemsize
    if not (isinstance(data, bytes) and len(data) == size):
        found = f"{len(data)} bytes" if isinstance(data, bytes) else type(data).__name__
        raise InvalidInput(
            "message", f"an array of shape {shape} and type {dtype} with {found}", f"{size} bytes"
        )
    return np.ndarray(shape, dtype, data)


def _no_extension(code: int, data: bytes) -> Any:
    raise InvalidInput("message", f"msgpack's extension type {code}", _MESSAGE)


def _short(value: Any) -> str:
    # What a stranger sent may be as long as a message.
    text = repr(value) if not isinstance(value, bytes) else f"{len(value)} bytes"
    return text if len(text) <= 60 else text[:57] + "..."
