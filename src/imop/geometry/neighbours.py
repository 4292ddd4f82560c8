"""Nearest neighbours in point clouds (scipy's k-d tree)."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from imop.errors import InvalidInput
from imop.types import BoolArray, FloatArray


def nearest(query: FloatArray, points: FloatArray, k: int = 1) -> tuple[FloatArray, NDArray[np.int64]]:
    """The `k` of `points` (N, 3) nearest to each query (M, 3): distances and indices, (M, k), nearest first.

    Raises:
        InvalidInput: if there are fewer than `k` points.
    """
    if not 1 <= k <= len(points):
        raise InvalidInput(
            "k", f"{k} with {len(points)} points", "at least 1 and at most the number of points"
        )
    distances, indices = cKDTree(points).query(query, k=k)
    shape = (len(query), k)
    return np.asarray(distances).reshape(shape), np.asarray(indices, dtype=np.int64).reshape(shape)


def within(query: FloatArray, points: FloatArray, radius: float) -> BoolArray:
    """(M,) True where a query has one of `points` nearer than `radius`; all False if there are no points."""
    if not len(points):
        return np.zeros(len(query), dtype=bool)
    distances, _ = cKDTree(points).query(query, distance_upper_bound=radius)
    return np.isfinite(distances)
