"""Vertices and triangles, which all shapes of a file share."""

import numpy as np

from imop.errors import ModelFormatError
from imop.tasks.coppelia.chains import chain
from imop.tasks.coppelia.sections import Section, Values
from imop.types import Float32Array, IntArray

_BIAS = np.array([31, 8191, 2097151, 536870911])


def vertices(values: Values) -> Float32Array:
    """(v, 3)."""
    start = values.at
    flat = values.finite32()
    if len(flat) % 3:
        raise ModelFormatError(start, f"{len(flat)} numbers", "three for every vertex")
    return flat.reshape(-1, 3)


def _triangles(flat: IntArray, start: int) -> IntArray:
    if len(flat) % 3:
        raise ModelFormatError(start, f"{len(flat)} indices", "three for every triangle")
    return flat.reshape(-1, 3)


def plain_indices(values: Values) -> IntArray:
    """(t, 3) from integers of four bytes."""
    start = values.at
    return _triangles(values.rest32("<i4").astype(np.int32), start)


def packed_indices(values: Values) -> IntArray:
    """(t, 3) from differences of one to four bytes; the first two bits of each say how many."""
    start = values.at
    n = values.count(values.end - values.at)
    data = values.rest32("u1").astype(np.int64)
    extra = data >> 6
    first = chain((np.arange(len(data)) + 1 + extra).astype(np.int32), 0)
    if len(first) < n or (n and first[n - 1] + extra[first[n - 1]] >= len(data)):
        raise ModelFormatError(start, f"fewer than {n} packed numbers", f"{n} as announced")
    first = first[:n]
    padded = np.append(data, [0, 0, 0])
    value = data[first] & 63
    for i, shift in enumerate((6, 14, 22)):
        value += np.where(extra[first] > i, padded[first + i + 1] << shift, 0)
    return _triangles(np.cumsum(value - _BIAS[extra[first]]).astype(np.int32), start)


class SharedArrays:
    """The numbered lists of a model, decoded when asked for.

    Args:
        section: VIN, or a mesh that holds its own lists; None where there is none.
    """

    def __init__(self, section: Section | None):
        items = [] if section is None else section.items
        body = b"" if section is None else section.body
        self._vertices = [Values(body, a, b) for tag, a, b in items if tag == "Ver"]
        self._triangles = [(tag, Values(body, a, b)) for tag, a, b in items if tag in ("Ind", "In2")]
        self._found: dict[tuple[int, int], tuple[Float32Array, IntArray]] = {}

    def mesh(self, vertex_list: int, index_list: int, offset: int) -> tuple[Float32Array, IntArray]:
        """Vertices (v, 3) and triangles (t, 3) with these numbers, for the mesh at byte `offset`.

        Raises:
            ModelFormatError: if there are no such lists, or a triangle names a vertex that is not there.
        """
        numbers = (vertex_list, index_list)
        if not (0 <= vertex_list < len(self._vertices) and 0 <= index_list < len(self._triangles)):
            raise ModelFormatError(offset, f"lists {numbers} of vertices and triangles", "numbers of lists")
        if numbers not in self._found:
            points = vertices(self._copy(self._vertices[vertex_list]))
            tag, values = self._triangles[index_list]
            found = (packed_indices if tag == "In2" else plain_indices)(self._copy(values))
            if found.size and not (found.min() >= 0 and found.max() < len(points)):
                raise ModelFormatError(values.at, "a triangle's vertex is missing", f"0 .. {len(points) - 1}")
            self._found[numbers] = (points, found)
        return self._found[numbers]

    @staticmethod
    def _copy(values: Values) -> Values:
        return Values(values.body, values.at, values.end, values.wide)
