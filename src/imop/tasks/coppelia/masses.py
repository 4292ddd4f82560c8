"""Masses that a simulator of rigid bodies can live with.

Many masses in files are nominal (half a milligram of dirt, a cube of seven kilograms that fits into a hand),
and moments are now and then far too small, which lets things sink into each other. Both are kept within what
the shape's bounding box allows.
"""

import numpy as np

from imop.geometry import se3
from imop.tasks.coppelia.model import Shape
from imop.types import FloatArray

LIGHTEST, HEAVIEST = 20.0, 8000.0
"""Densities of the bounding box, kg/m3."""
LEAST_MASS = 0.002
SLIMMEST, WIDEST = 0.5, 4.0
"""Moments, as parts of the full bounding box's."""


def mass_and_moments(shape: Shape) -> tuple[float, FloatArray]:
    """Kilograms and principal moments (3,) kg m2 about `shape.T_shape_inertia`, the file's if possible."""
    corners = se3.apply(se3.invert(shape.T_shape_inertia), shape.corners.reshape(-1, 3))
    if len(corners) == 0:
        corners = np.zeros((1, 3))
    size = np.maximum(corners.max(axis=0) - corners.min(axis=0), 1e-3)
    volume = float(np.prod(size))
    mass = max(float(np.clip(shape.mass, LIGHTEST * volume, HEAVIEST * volume)), LEAST_MASS)
    box = mass / 12 * (np.sum(size**2) - size**2)
    own = shape.moments * (mass / shape.mass) if shape.mass > 0 else box
    moments = np.clip(own, SLIMMEST * box, WIDEST * box)
    # No body has a moment greater than the sum of the others.
    moments = np.maximum(moments, moments.max() - np.sort(moments)[1] + 1e-12)
    return mass, moments
