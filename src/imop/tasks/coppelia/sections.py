"""The grammar of a body: items of a three-letter tag, a length and a payload, often a section itself."""

from dataclasses import dataclass

import numpy as np

from imop.errors import ModelFormatError
from imop.geometry import se3
from imop.types import Float32Array, FloatArray, IntArray

_TERMINATORS = (b"EOO", b"NXT", b"EOF")
_LARGEST = 1e9
"""Numbers of poses and sizes beyond are broken; unused fields of sensors may hold more."""


@dataclass
class Values:
    """The payload of one item, read from front to back; every read says where it found less than it wanted.

    Attributes:
        body: the whole model.
        at: where to read next.
        end: where the payload ends.
        wide: whether floats take eight bytes, as in files of newer programs.
    """

    body: bytes
    at: int
    end: int
    wide: bool = False

    def _take(self, dtype: str, n: int, what: str) -> np.ndarray:
        size = np.dtype(dtype).itemsize
        if not 0 <= n <= (self.end - self.at) // size:
            raise ModelFormatError(self.at, f"{self.end - self.at} bytes are left", f"{n} {what}")
        found = np.frombuffer(self.body, dtype=dtype, count=n, offset=self.at)
        self.at += n * size
        return found

    def ints(self, n: int) -> IntArray:
        """(n,) signed integers of four bytes."""
        return self._take("<i4", n, "integers of 4 bytes").astype(np.int32)

    def one_int(self) -> int:
        """One signed integer of four bytes."""
        return int(self.ints(1)[0])

    def count(self, largest: int) -> int:
        """An integer that counts something.

        Raises:
            ModelFormatError: if it is not in 0 .. `largest`.
        """
        n = self.one_int()
        if not 0 <= n <= largest:
            raise ModelFormatError(self.at - 4, f"a count of {n}", f"0 .. {largest}")
        return n

    def u8(self) -> int:
        """One byte."""
        return int(self._take("u1", 1, "byte")[0])

    def u16(self) -> int:
        """An unsigned integer of two bytes."""
        return int(self._take("<u2", 1, "integer of 2 bytes")[0])

    def any_floats(self, n: int) -> FloatArray:
        """(n,) numbers of any value."""
        with np.errstate(invalid="ignore"):  # some patterns of bits are not even proper NaNs
            return self._take("<f8" if self.wide else "<f4", n, "numbers").astype(np.float64)

    def floats(self, n: int) -> FloatArray:
        """(n,) finite numbers."""
        start = self.at
        found = self.any_floats(n)
        if not np.all(np.abs(found) <= _LARGEST):
            raise ModelFormatError(start, "not finite or huge", f"{n} numbers of ordinary size")
        return found

    def one_float(self) -> float:
        """One finite number."""
        return float(self.floats(1)[0])

    def rest32(self, dtype: str = "<f4") -> np.ndarray:
        """All that is left as an array of `dtype`, which never widens."""
        size = np.dtype(dtype).itemsize
        if (self.end - self.at) % size:
            raise ModelFormatError(self.at, f"{self.end - self.at} bytes", f"a multiple of {size}")
        return self._take(dtype, (self.end - self.at) // size, "values")

    def finite32(self) -> Float32Array:
        """All that is left as finite floats of four bytes."""
        start = self.at
        found: Float32Array = self.rest32()
        if not np.all(np.abs(found) <= _LARGEST):
            raise ModelFormatError(start, "not finite or huge", "numbers of ordinary size")
        return found

    def text(self) -> str:
        """A length and so many bytes of text."""
        n = self.count(self.end - self.at)
        return self._take("u1", n, "bytes of text").tobytes().decode("utf-8", errors="replace")

    def pose(self, position_first: bool) -> FloatArray:
        """(4, 4) from a position and a quaternion w x y z, in either order."""
        start = self.at
        seven = self.floats(7)
        p, q = (seven[:3], seven[3:]) if position_first else (seven[4:], seven[:4])
        if np.linalg.norm(q) < 1e-3:
            raise ModelFormatError(start, "a quaternion of length 0", "a unit quaternion")
        return se3.make(se3.from_wxyz(q), p)


class Section:
    """The items of a section, in order.

    Args:
        body: the whole model.
        start: where the first item begins.
        items: (tag, payload's start, payload's end) of each.
    """

    def __init__(self, body: bytes, start: int, items: list[tuple[str, int, int]]):
        self.body, self.start, self.items = body, start, items
        self._first: dict[str, tuple[str, int, int]] = {}
        for item in items:
            self._first.setdefault(item[0], item)

    def get(self, tag: str) -> Values | None:
        """The first item of that old name, or of its twin with wide floats; None if there is neither."""
        found = self._first.get(tag) or self._first.get("_" + tag[1:])
        return None if found is None else Values(self.body, found[1], found[2], found[0].startswith("_"))

    def require(self, tag: str) -> Values:
        """As `get`.

        Raises:
            ModelFormatError: if there is no such item.
        """
        found = self.get(tag)
        if found is None:
            raise ModelFormatError(self.start, f"no {tag} in a section", f"an item {tag}")
        return found

    def flags(self, tag: str) -> int:
        """One byte of flags, 0 if they are not there."""
        found = self.get(tag)
        return 0 if found is None else found.u8()

    def text(self, tag: str) -> str:
        """A text, empty if it is not there."""
        found = self.get(tag)
        return "" if found is None else found.text()

    def inner(self, tag: str) -> "Section | None":
        """The section that is the payload of the first item of that name."""
        found = self._first.get(tag)
        return None if found is None else read_section(self.body, found[1], found[2])[0]

    def all_inner(self, tag: str) -> "list[Section]":
        """The sections of all items of that name."""
        return [read_section(self.body, a, b)[0] for t, a, b in self.items if t == tag]


def read_section(body: bytes, start: int, end: int, terminator: str = "EOO") -> tuple[Section, int]:
    """Read items from `start` up to `terminator`.

    Returns:
        The section, and where the terminator ends.

    Raises:
        ModelFormatError: if an item is longer than what is left before `end`, or the terminator is missing.
    """
    wanted, at = terminator.encode(), start
    items: list[tuple[str, int, int]] = []
    while True:
        tag = body[at : at + 3]
        if at + 3 <= end and tag == wanted:
            return Section(body, start, items), at + 3
        if at + 7 > end or tag in _TERMINATORS:
            raise ModelFormatError(at, f"a section ends with {tag!r}", terminator)
        length = int.from_bytes(body[at + 3 : at + 7], "little", signed=True)
        if not 0 <= length <= end - at - 7:
            raise ModelFormatError(at + 3, f"item {tag!r} of {length} bytes", f"0 .. {end - at - 7}")
        items.append((tag.decode("latin-1"), at + 7, at + 7 + length))
        at += 7 + length
