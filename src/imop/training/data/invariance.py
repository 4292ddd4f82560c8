"""How far the points of one thing are from where another of its kind has them, both seen from the action.

That is the epsilon of the paper's Definition 1, point by point: about zero where the thing is grasped or has
to fit, large where the shapes differ.
"""

import numpy as np

from imop.geometry import se3
from imop.geometry.neighbours import nearest
from imop.types import FloatArray

INVARIANT = 0.01
"""A step in which no part of the region stays this near to the action, metres, has no invariant region."""
_PART = 0.05
"""Share of the region that is a part."""


def distances(
    points: FloatArray, T_support_goal: FloatArray, others: FloatArray, T_query_goal: FloatArray
) -> FloatArray:
    """(N,) how far points are from the nearest of another thing's, both seen from the action, metres.

    Args:
        points: (N, 3) of the thing shown, world frame.
        T_support_goal: (4, 4) the action on it, T_i.
        others: (M, 3) of the other thing, M >= 1, world frame of the query.
        T_query_goal: (4, 4) the action on that one, T_j.
    """
    seen = se3.apply(se3.invert(T_support_goal), points)
    return nearest(seen, se3.apply(se3.invert(T_query_goal), others))[0][:, 0]


def has_invariant_part(label: FloatArray) -> bool:
    """Whether a part of the region stays near to the action, by its labels (N,), NaN where unknown."""
    known = label[np.isfinite(label)]
    return bool(len(known) and np.quantile(known, _PART) < INVARIANT)
