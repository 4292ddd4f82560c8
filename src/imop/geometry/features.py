"""Local shape descriptors: Fast Point Feature Histograms (Rusu, Blodow and Beetz, ICRA 2009).

Our own, in numpy and scipy, because the usual implementation (Open3D) needs system libraries (libGL, libX11).
"""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.spatial import cKDTree

from imop.errors import InvalidInput
from imop.types import FloatArray, as_array

Indices = NDArray[np.int64]

BINS = 11
DIMENSIONS = 3 * BINS


def _pair_angles(points: FloatArray, normals: FloatArray, i: Indices, j: Indices) -> FloatArray:
    """The three angles of each pair (P, 3), scaled to [0, 1]; NaN where they are not defined.

    The point whose normal is closer to the connecting line is the source, which makes the angles symmetric
    in i and j.
    """
    line = points[j] - points[i]
    line /= np.maximum(np.linalg.norm(line, axis=1, keepdims=True), 1e-12)
    cos_i = np.einsum("pk,pk->p", normals[i], line)
    cos_j = np.einsum("pk,pk->p", normals[j], line)
    swap = np.abs(cos_i) < np.abs(cos_j)
    source = np.where(swap[:, None], normals[j], normals[i])
    target = np.where(swap[:, None], normals[i], normals[j])
    line = np.where(swap[:, None], -line, line)
    phi = np.where(swap, -cos_j, cos_i)
    v = np.cross(line, source)
    length = np.linalg.norm(v, axis=1)
    v /= np.maximum(length, 1e-12)[:, None]
    alpha = np.einsum("pk,pk->p", v, target)
    theta = np.arctan2(
        np.einsum("pk,pk->p", np.cross(source, v), target), np.einsum("pk,pk->p", source, target)
    )
    angles = np.stack([(theta + np.pi) / (2 * np.pi), (alpha + 1) / 2, (phi + 1) / 2], axis=1)
    angles[length < 1e-9] = np.nan
    return angles


def fpfh(points: FloatArray, normals: FloatArray, radius: float) -> FloatArray:
    """Describe the shape around every point by a histogram that rigid motion does not change.

    Args:
        points: (N, 3) metres.
        normals: (N, 3) unit vectors with a consistent side (towards the camera).
        radius: neighbourhood, metres; about five times the spacing of the points.

    Returns:
        (N, 33) three histograms of 11 bins, each summing to 200; 0 where a point has no neighbours.

    Raises:
        InvalidInput: if the shapes differ or the radius is not positive.
    """
    points = as_array("points", points, (None, 3))
    normals = as_array("normals", normals, (len(points), 3))
    if not radius > 0:
        raise InvalidInput("radius", f"{radius}", "a positive length in metres")
    count = len(points)
    if count == 0:
        return np.zeros((0, DIMENSIONS))
    pairs = cKDTree(points).query_pairs(radius, output_type="ndarray")
    i, j = pairs[:, 0].astype(np.int64), pairs[:, 1].astype(np.int64)
    angles = _pair_angles(points, normals, i, j)
    squared = np.sum((points[i] - points[j]) ** 2, axis=1)
    defined = np.isfinite(angles[:, 0])
    simple = np.zeros(count * DIMENSIONS)
    bins = np.minimum((angles[defined] * BINS).astype(np.int64), BINS - 1) + BINS * np.arange(3)
    for end in (i[defined], j[defined]):
        simple += np.bincount((end[:, None] * DIMENSIONS + bins).ravel(), minlength=len(simple))
    blocks = simple.reshape(count, 3, BINS)
    blocks = _normalised(blocks)
    # Neighbours count by inverse squared distance; coincident points would count infinitely.
    weight = np.where(squared > 0, 1.0 / np.maximum(squared, 1e-12), 0.0)
    graph = coo_array((np.r_[weight, weight], (np.r_[i, j], np.r_[j, i])), shape=(count, count)).tocsr()
    around = (graph @ blocks.reshape(count, -1)).reshape(count, 3, BINS)
    features: FloatArray = (blocks + _normalised(around)).reshape(count, DIMENSIONS)
    return features


def _normalised(blocks: FloatArray) -> FloatArray:
    """Histograms (N, 3, 11) scaled to sum to 100; empty ones stay empty."""
    total = blocks.sum(axis=2, keepdims=True)
    scaled: FloatArray = 100.0 * blocks / np.where(total > 0, total, 1.0)
    return scaled
