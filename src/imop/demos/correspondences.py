"""Which point of one state is which of another: the paper's pairs that are minimal in the action's frame."""

import numpy as np
from numpy.typing import NDArray

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.geometry.neighbours import nearest
from imop.types import FloatArray

RADIUS = 0.01
"""Points farther apart than this in the action's frame are not the same point, metres."""


def correspondences(
    p_support: FloatArray,
    T_support: FloatArray,
    p_query: FloatArray,
    T_query: FloatArray,
    radius: float = RADIUS,
) -> NDArray[np.int64]:
    """Pairs (P, 2) of indices: points that are each other's nearest, seen from the gripper after the action.

    One motion carries all of them, and no point is in two pairs, so the pairs of a symmetric object never
    contradict each other.

    Args:
        p_support: (N, 3) points of the region in s_i, world frame, metres.
        T_support: (4, 4) action pose T_i.
        p_query: (M, 3) points of s_j, world frame, metres.
        T_query: (4, 4) action pose T_j.
        radius: metres.

    Raises:
        InvalidInput: if the radius is not positive.
    """
    if not radius > 0:
        raise InvalidInput("radius", f"{radius}", "a positive distance in metres")
    if not (len(p_support) and len(p_query)):
        return np.zeros((0, 2), dtype=np.int64)
    a = se3.apply(se3.invert(T_support), p_support)
    b = se3.apply(se3.invert(T_query), p_query)
    distance, forth = (found[:, 0] for found in nearest(a, b))
    back = nearest(b, a)[1][:, 0]
    first = np.arange(len(a))
    mutual = (back[forth] == first) & (distance < radius)
    return np.stack([first[mutual], forth[mutual]], axis=1)
