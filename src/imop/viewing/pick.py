"""What a click means: the thing whose points its ray hits first."""

import numpy as np

from imop.geometry.clusters import connected
from imop.policy.interfaces import Scene
from imop.types import FloatArray

# A ray hits points that are this near to it, metres: clouds have gaps between their points.
BESIDE_RAY = 0.01


def hit(points: FloatArray, origin: FloatArray, direction: FloatArray) -> int | None:
    """Number of the first of points (N, 3) that a ray hits; None if it hits none.

    Args:
        points: metres.
        origin: (3,) of the ray.
        direction: (3,) of any length.
    """
    unit = np.asarray(direction) / np.linalg.norm(direction)
    along = (points - origin) @ unit
    beside = np.linalg.norm(points - origin - along[:, None] * unit, axis=1)
    hits = np.flatnonzero((along > 0) & (beside < BESIDE_RAY))
    return int(hits[along[hits].argmin()]) if len(hits) else None


def thing_at(scene: Scene, origin: FloatArray, direction: FloatArray) -> FloatArray | None:
    """(K, 3) points of the thing that a ray hits, metres; None if it hits nothing, or the ground.

    Args:
        scene: the observed one.
        origin: (3,) of the ray, world frame, metres.
        direction: (3,) of any length.
    """
    points = scene.fused.points
    number = hit(points, origin, direction)
    if number is None:
        return None
    standing = points[~scene.ground.bare]
    away = np.linalg.norm(standing - points[number], axis=1)
    if not len(away) or away.min() > BESIDE_RAY:
        return None
    labels = connected(standing)
    return np.asarray(standing[labels == labels[away.argmin()]])
