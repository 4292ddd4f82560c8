"""Signed distances from points to primitive shapes: negative inside, in the shape's own frame.

Sizes are MuJoCo's: half extents of boxes and ellipsoids, (radius, half length) of capsules and
cylinders along z.
"""

from functools import reduce
from itertools import product

import numpy as np
from scipy.spatial import ConvexHull

from imop.geometry.se3 import lengths
from imop.types import FloatArray

# Boxes around wrist, palm and fingers of a parallel gripper, after the Panda's: lower and upper corner,
# gripper frame, metres.
PARALLEL_GRIPPER = np.array(
    [
        [[-0.045, -0.045, -0.2], [0.045, 0.045, -0.105]],
        [[-0.03, -0.1, -0.105], [0.03, 0.1, -0.05]],
        [[-0.01, -0.05, -0.05], [0.01, 0.05, -0.01]],
    ]
)

FAR = 0.05
"""Distances to hulls of meshes are exact up to here only, metres."""
_SIDES = np.array([d for d in product((-1.0, 0.0, 1.0), repeat=3) if any(d)])
_SIDES /= np.linalg.norm(_SIDES, axis=1, keepdims=True)


def sphere(p: FloatArray, size: FloatArray) -> FloatArray:
    """Distances (N,) of points `p` (N, 3) to a sphere of radius size[0]."""
    return np.asarray(lengths(p) - size[0])


def capsule(p: FloatArray, size: FloatArray) -> FloatArray:
    """Distances (N,) of points `p` (N, 3) to a capsule of radius size[0] and half length size[1] along z."""
    z = p[:, 2] - np.clip(p[:, 2], -size[1], size[1])
    return np.asarray(np.sqrt(p[:, 0] ** 2 + p[:, 1] ** 2 + z**2) - size[0])


def cylinder(p: FloatArray, size: FloatArray) -> FloatArray:
    """Distances (N,) of points `p` (N, 3) to a cylinder of radius size[0] and half length size[1] along z."""
    return _beyond(np.stack([np.hypot(p[:, 0], p[:, 1]) - size[0], np.abs(p[:, 2]) - size[1]], axis=1))


def box(p: FloatArray, size: FloatArray) -> FloatArray:
    """Distances (N,) of points `p` (N, 3) to a box of half extents `size` (3,)."""
    return _beyond(np.abs(p) - size)


def ellipsoid(p: FloatArray, size: FloatArray) -> FloatArray:
    """Distances (N,) of points `p` (N, 3) to an ellipsoid of semi-axes `size` (3,).

    Exact to first order near the surface; the sign is exact everywhere.
    """
    level = lengths(p / size)
    slope = lengths(p / size**2)
    # At the centre level and slope vanish together; the nearest surface is the shortest semi-axis away.
    safe = np.where(slope > 0, slope, 1.0)
    return np.asarray(np.where(slope > 0, level * (level - 1) / safe, -size.min()))


def half_spaces(vertices: FloatArray) -> FloatArray:
    """Planes (M, 4) of the convex hull of `vertices` (N, 3): n.x + d <= 0 inside, |n| = 1.

    The first ones face all sides, for `convex`.
    """
    planes = np.unique(ConvexHull(vertices).equations.round(9), axis=0)
    first = np.unique((planes[:, :3] @ _SIDES.T).argmax(axis=0))
    return np.concatenate([planes[first], np.delete(planes, first, axis=0)])


def convex(p: FloatArray, planes: FloatArray) -> FloatArray:
    """Distances (N,) of points `p` (N, 3) to the solid behind `planes` (M, 4).

    Exact inside and in front of faces; too small in front of edges and corners, and beyond `FAR`, but not
    less than `FAR` there.
    """
    few = planes[: len(_SIDES)]
    distance = np.asarray((p @ few[:, :3].T + few[:, 3]).max(axis=1))
    if len(planes) > len(few):
        # Most points are far from most solids, and hulls of meshes have thousands of planes.
        near, rest = np.flatnonzero(distance < FAR), planes[len(few) :]
        distance[near] = np.maximum(distance[near], (p[near] @ rest[:, :3].T + rest[:, 3]).max(axis=1))
    return distance


def _beyond(excess: FloatArray) -> FloatArray:
    """Distance to a product of intervals from how far (N, k) each coordinate lies beyond its own."""
    positive = np.maximum(excess, 0)
    outside = np.sqrt(np.einsum("nk,nk->n", positive, positive))
    # Column by column: reducing short rows is several times as slow.
    return np.asarray(outside + np.minimum(reduce(np.maximum, excess.T), 0))
