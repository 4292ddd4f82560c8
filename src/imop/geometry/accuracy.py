"""How far a predicted pose is from the right ones, and how near it has to be."""

import numpy as np

from imop.geometry import se3
from imop.types import FloatArray

FINE, COARSE = (0.01, 5.0), (0.02, 10.0)
"""Metres and degrees that a prediction has to stay below."""


def errors(T: FloatArray, right: FloatArray) -> tuple[float, float]:
    """Metres and radians between a pose (4, 4) and the nearest of `right` (N, 4, 4).

    1 cm weighs as much as 5 degrees; the larger of both errors counts.
    """
    metres = se3.translation_distance(T, right)
    radians = se3.rotation_distance(T, right)
    off = np.stack([metres / FINE[0], radians / np.radians(FINE[1])])
    # The sum decides among poses whose larger error is the same.
    best = int(np.argmin(off.max(axis=0) + 1e-3 * off.sum(axis=0)))
    return float(metres[best]), float(radians[best])
