"""The compression of model files: a static Huffman code of single bytes, most significant bit first.

The bits are the tree in pre-order (1 and eight bits: a leaf; 0: an inner node, then its two children), then
the codes, with no alignment between them.
"""

from dataclasses import dataclass

import numpy as np

from imop.errors import ModelFormatError
from imop.tasks.coppelia.chains import chain
from imop.types import ByteArray, IntArray

_WINDOW = 12
"""Bits that one look at the table decides."""
_LONGEST = 45
"""A code of that many bits needs Fibonacci's 47th number of bytes, more than a size can say."""
_CHUNK = 1 << 15
"""Bytes that are decoded at once; bounds the memory."""


@dataclass(frozen=True, eq=False)
class _Code:
    """Children (nodes, 2), symbol (nodes,) or -1, and for every window the node it leads to and its depth."""

    child: IntArray
    symbol: IntArray
    node: IntArray
    depth: IntArray
    first_bit: int


def decode(data: bytes, start: int, size: int) -> bytes:
    """Unpack `size` bytes from the bit stream that begins at byte `start` of `data`.

    Raises:
        ModelFormatError: with the byte offset in `data`, if tree or codes are broken or end too early.
    """
    stream = np.frombuffer(data, dtype=np.uint8)[start:]
    if size > 8 * len(stream):
        raise ModelFormatError(start, f"{size} bytes in {len(stream)}", "at least one bit for every byte")
    code = _read_tree(stream, start)
    parts: list[ByteArray] = []
    missing, bit, end = size, code.first_bit, 8 * len(stream)
    padded = np.concatenate([stream, np.zeros(8 + _LONGEST // 8, dtype=np.uint8)])
    while missing > 0:
        if bit >= end:
            raise ModelFormatError(start + bit // 8, f"{missing} bytes are missing", "more codes")
        first = bit // 8
        part, used = _decode_chunk(padded, first, min(_CHUNK, len(stream) - first), bit - 8 * first, code)
        bit = 8 * first + used
        if bit > end and len(part) <= missing:
            raise ModelFormatError(start + len(stream), "the last code is cut off", "more codes")
        parts.append(part[:missing])
        missing -= len(parts[-1])
    return np.concatenate(parts).tobytes() if parts else b""


def _decode_chunk(stream: ByteArray, first: int, n: int, bit: int, code: _Code) -> tuple[ByteArray, int]:
    """The codes that begin in `n` bytes, from `bit` of the first; and the bit after the last."""
    wide = stream[first : first + n + 2].astype(np.int32)
    three = (wide[:-2] << 16) | (wide[1:-1] << 8) | wide[2:]
    windows = (
        ((three[:, None] >> (24 - _WINDOW - np.arange(8))) & ((1 << _WINDOW) - 1)).ravel().astype(np.int32)
    )
    node, depth = code.node[windows], code.depth[windows]
    long = np.flatnonzero(code.symbol[node] < 0)
    bits = stream[first : first + n + 2 + _LONGEST // 8]
    while len(long):
        place = long + depth[long]
        value = (bits[place >> 3] >> (7 - (place & 7))) & 1
        node[long] = code.child[node[long], value]
        depth[long] += 1
        long = long[code.symbol[node[long]] < 0]
    places = chain(np.arange(8 * n, dtype=np.int32) + depth, bit)
    after = int(places[-1] + depth[places[-1]]) if len(places) else bit
    return code.symbol[node[places]].astype(np.uint8), after


def _read_tree(stream: ByteArray, start: int) -> _Code:
    bits = np.unpackbits(stream[: 511 * 2])
    child: list[list[int]] = []
    symbol: list[int] = []
    depths: list[int] = []
    waiting = [(-1, 0, 0)]  # parent, side, depth
    at = 0
    while waiting:
        parent, side, depth = waiting.pop()
        if at + 9 > len(bits) or len(symbol) >= 511 or depth > _LONGEST:
            raise ModelFormatError(
                start + at // 8, "a broken Huffman tree", "at most 256 leaves and short codes"
            )
        if parent >= 0:
            child[parent][side] = len(symbol)
        depths.append(depth)
        if bits[at]:
            symbol.append(int(np.packbits(bits[at + 1 : at + 9])[0]))
            child.append([0, 0])
            at += 9
        else:
            waiting += [(len(symbol), 1, depth + 1), (len(symbol), 0, depth + 1)]
            symbol.append(-1)
            child.append([0, 0])
            at += 1
    if len(symbol) == 1:  # one leaf: every byte still takes a bit
        return _Code(*_lone_leaf(symbol[0]), first_bit=at)
    return _Code(*_window_table(np.array(child, np.int32), np.array(symbol, np.int32)), first_bit=at)


def _window_table(child: IntArray, symbol: IntArray) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    windows = np.arange(1 << _WINDOW, dtype=np.int32)
    node, depth = np.zeros_like(windows), np.zeros_like(windows)
    for i in range(_WINDOW):
        inner = symbol[node] < 0
        value = (windows >> (_WINDOW - 1 - i)) & 1
        node = np.where(inner, child[node, value], node)
        depth += inner
    return child, symbol, node.astype(np.int32), depth


def _lone_leaf(symbol: int) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    n = 1 << _WINDOW
    zero, one = np.zeros(n, dtype=np.int32), np.ones(n, dtype=np.int32)
    return np.zeros((1, 2), np.int32), np.array([symbol], np.int32), zero, one
