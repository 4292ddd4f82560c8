"""Where the bulk of the surroundings lies from each point: what tells a thing from its mirror image.

Every other feature of a point, and a cloud's statistics of single neighbourhoods, are the same for a left and
a right lever. The turn from one bearing to another is not: its sign changes in the mirror.
"""

import numpy as np

from imop.types import BoolArray, FloatArray

REACH = 0.15
SCALES = 3
BEARINGS = 9
# Triple products of bearings, which are shorter than their scale, are small numbers.
_GAIN = 10.0


def bearings(points: FloatArray, normals: FloatArray, thing: BoolArray) -> FloatArray:
    """(N, BEARINGS) unchanged by moves along the table and turns about the vertical, but not by mirrors.

    A bearing is the mean offset to the points around, weighted by exp(-d^2 / 2 s^2) with s of 2.5, 5 and 10
    cm and in units of 1.5 s. Five triple products with the vertical, of bearings with each other and with the
    normal; then length and rise of the farthest bearing, length of the middle one, and how far the farthest
    follows the normal.

    Args:
        points: (N, 3) metres.
        normals: (N, 3) unit vectors.
        thing: (N,) True for points that count: the bare plane looks alike everywhere.
    """
    here = (points - points.mean(axis=0)).astype(np.float32)
    there = here[thing]
    square = (here**2).sum(1)[:, None] + (there**2).sum(1) - 2 * here @ there.T
    sigma = REACH / 1.5
    weight = np.exp(-np.maximum(square, 0) / (2 * sigma**2))
    found = []
    for _ in range(SCALES):
        total = weight.sum(axis=1, keepdims=True)
        mean = (weight @ there) / np.maximum(total, 1e-6) - here
        found.append(np.where(total > 1e-3, mean / (1.5 * sigma), 0.0))
        # Half the scale is the fourth power of the weight.
        weight, sigma = np.square(np.square(weight)), sigma / 2
    far, middle, near = found
    columns = [
        _GAIN * _turn(near, middle),
        _GAIN * _turn(middle, far),
        _GAIN * _turn(near, far),
        _turn(normals, middle),
        _turn(normals, far),
        np.linalg.norm(far, axis=1),
        far[:, 2],
        np.linalg.norm(middle, axis=1),
        np.einsum("nk,nk->n", normals, far),
    ]
    return np.stack(columns, axis=1)


def _turn(a: FloatArray, b: FloatArray) -> FloatArray:
    """(N,) triple product of the vertical with rows of `a` and `b`."""
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
