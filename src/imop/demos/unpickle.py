"""Read RLBench's pickles without RLBench, and without running what a pickle may ask for."""

import io
import pickle
import pickletools
import re
from pathlib import Path
from typing import Any, Self

import numpy as np

from imop.errors import CorruptData
from imop.files import read


class Record:
    """Holds the attributes that a pickled RLBench object had; knows nothing else."""

    fields: dict[str, Any]

    def __new__(cls) -> Self:
        """An empty record; pickle makes objects without calling `__init__`."""
        record = super().__new__(cls)
        record.fields = {}
        return record

    # Without this method pickle would write into __dict__ of whatever it is pointed at, this class included.
    def __setstate__(self, state: dict[str, Any]) -> None:
        self.fields = dict(state)


class DemoRecord(Record):
    """Stands for rlbench.demo.Demo."""


class ObservationRecord(Record):
    """Stands for rlbench.backend.observation.Observation."""


# numpy's own functions trust what a pickle says (how large an array is, where objects lie in it), so these
# stand for them. Every array takes its numbers from the file, so none is larger than the file.


class _DType:
    """Stands for numpy.dtype, of numbers and text only."""

    def __init__(self, code: str, align: bool = False, copy: bool = False):
        if not re.fullmatch(r"[biufSU][1-9]\d{0,5}", code):
            raise ValueError(f"arrays of type {code!r}; numbers and text are read")
        self.value = np.dtype(code)

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        self.value = self.value.newbyteorder(state[1])


class _Array(np.ndarray[Any, np.dtype[Any]]):
    """Stands for numpy.ndarray; pickle makes it empty and then gives it its content."""

    def __new__(cls) -> Self:
        """Empty, whatever shape a pickle asks for."""
        return super().__new__(cls, (0,), np.int8)

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        version, shape, dtype, by_columns, content = state
        super().__setstate__((version, shape, dtype.value, by_columns, _bytes_of(content)))


def _empty_array(*_: Any) -> _Array:
    return _Array()


def _array(content: Any, dtype: _DType, shape: Any, order: Any, axes: Any = None) -> Any:
    array = np.frombuffer(_bytes_of(content), dtype.value)
    return array.reshape(shape).transpose(axes) if order == "K" else array.reshape(shape, order=order)


def _scalar(dtype: _DType, content: Any) -> Any:
    (value,) = np.frombuffer(_bytes_of(content), dtype.value)
    return value


def _bytes_of(content: Any) -> bytes:
    if not isinstance(content, bytes | bytearray):
        raise TypeError(f"the content of an array is a {type(content).__name__}, not bytes")
    return bytes(content)


def _encode(text: str, encoding: str) -> bytes:
    """How protocol 2 writes bytes."""
    if encoding != "latin1":
        raise ValueError(f"bytes in the encoding {encoding!r}")
    return text.encode("latin1")


def _no_bytes() -> bytes:
    """How protocol 2 writes no bytes."""
    return b""


ALLOWED: dict[tuple[str, str], Any] = {
    ("rlbench.demo", "Demo"): DemoRecord,
    ("rlbench.backend.observation", "Observation"): ObservationRecord,
    ("numpy", "ndarray"): _Array,
    ("numpy", "dtype"): _DType,
    ("_codecs", "encode"): _encode,
    ("__builtin__", "bytes"): _no_bytes,
    **{
        # numpy 1 and 2
        (f"numpy.{core}.{module}", name): stand_in
        for core in ("core", "_core")
        for module, name, stand_in in (
            ("multiarray", "_reconstruct", _empty_array),
            ("multiarray", "scalar", _scalar),
            ("numeric", "_frombuffer", _array),
        )
    },
}


class _Forbidden(Exception):
    pass


class _Unpickler(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        try:
            return ALLOWED[module, name]
        except KeyError:
            raise _Forbidden(f"{module}.{name}") from None


def load(path: Path) -> Any:
    """The object pickled in the file `path`; RLBench's objects come as `DemoRecord` and `ObservationRecord`.

    Arrays and scalars are read as numpy 1 and 2 write them with protocols 2 to 5.

    Raises:
        CorruptData: if the file is missing, truncated, not a pickle, or names any class or function
            that RLBench's own files do not name (nothing of it is called then).
    """
    content = read(path)
    try:
        _check_sizes(content)
        return _Unpickler(io.BytesIO(content)).load()
    except _Forbidden as error:
        raise CorruptData(
            path,
            f"the pickle asks for {error}, which RLBench's files do not contain",
            "do not trust this file",
        ) from None
    except Exception as error:  # a damaged pickle can fail in any way at all
        raise CorruptData(path, f"not a readable pickle ({type(error).__name__}: {error})") from error


def _check_sizes(content: bytes) -> None:
    """Refuses lengths beyond the file, for which pickle would take the memory before it reads.

    Raises:
        ValueError: if there is one.
    """
    for opcode, argument, _ in pickletools.genops(content):
        if opcode.name.endswith("PUT") and argument is not None and argument > len(content):
            raise ValueError(f"object number {argument} in {len(content)} bytes")
