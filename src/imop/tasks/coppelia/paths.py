"""Curves: corners that are cut by Bezier arcs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from imop.geometry import se3
from imop.types import FloatArray

_STRAIGHT = 1e-9


@dataclass(frozen=True, eq=False)
class ControlPoint:
    """A corner.

    Attributes:
        T: (4, 4) in the path's frame.
        before: how much of the way from the corner back to the middle of its side the arc takes, 0 .. 1.
        after: the same forwards.
        points: of the arc; 1 or less leaves the corner as it is.
    """

    T: FloatArray
    before: float
    after: float
    points: int


def polyline(corners: Sequence[ControlPoint], closed: bool) -> FloatArray:
    """(n, 4, 4) the poses along the curve, straight in between."""
    if not corners:
        return np.zeros((0, 4, 4))
    n, poses = len(corners), []
    for i, corner in enumerate(corners):
        inner = closed or 0 < i < n - 1
        a, b = corners[i - 1].T, corners[(i + 1) % n].T
        if inner and corner.points > 1 and not _collinear(a, corner.T, b):
            poses += _arc(a, corner, b)
        else:
            poses.append(corner.T)
    return np.stack(poses)


def _collinear(a: FloatArray, p: FloatArray, b: FloatArray) -> bool:
    u, v = p[:3, 3] - a[:3, 3], b[:3, 3] - p[:3, 3]
    return bool(np.linalg.norm(np.cross(u, v)) <= _STRAIGHT)


def _between(a: FloatArray, b: FloatArray, t: float) -> FloatArray:
    turns = Slerp([0.0, 1.0], Rotation.from_matrix(np.stack([a[:3, :3], b[:3, :3]])))
    return se3.make(turns([t]).as_matrix()[0], (1 - t) * a[:3, 3] + t * b[:3, 3])


def _arc(a: FloatArray, corner: ControlPoint, b: FloatArray) -> list[FloatArray]:
    start = _between(_between(a, corner.T, 0.5), corner.T, 1 - corner.before)
    end = _between(_between(corner.T, b, 0.5), corner.T, 1 - corner.after)
    ways = np.linspace(0.0, 1.0, corner.points)
    return [_between(_between(start, corner.T, t), _between(corner.T, end, t), t) for t in ways]
