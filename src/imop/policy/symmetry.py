"""Which turns leave a region looking the same, as far as one demonstration shows.

The networks match a round thing in some turn or other; then they have no opinion on which turn is right.
"""

from itertools import product

import numpy as np

from imop.geometry import se3
from imop.geometry.cloud import farthest_points
from imop.policy.evidence import Surface
from imop.types import FloatArray

TURNS = np.radians(np.arange(45.0, 360.0, 45.0))
HALF = np.pi
# Share of a region that has to look the same: seen from some sides only, round things reach no more.
ALIKE = 0.7
# How far off the middle of what was seen the axis may be, metres.
OFF = (-0.008, 0.0, 0.008)
POINTS = 200


def equal_turns(surface: Surface, center: FloatArray) -> FloatArray:
    """(S, 4, 4) turns about the vertical near `center` (3,) after which a surface looks the same.

    The first is the identity. A lone half turn is not counted: front and back of most things look alike
    from afar, and differ.
    """
    few = surface.cloud.select(farthest_points(surface.cloud.points, POINTS))
    weight = np.ones(len(few))
    found = []
    for angle in TURNS:
        R = se3.euler(z=float(angle))
        shifts = [np.array([x, y, 0.0]) for x, y in product(OFF, OFF)]
        motions = [se3.make(R, center - R @ center + shift) for shift in shifts]
        alike = [surface.share(few, weight, T, surface.explain(few, T)[0]) for T in motions]
        if max(alike) > ALIKE:
            found.append((angle, motions[int(np.argmax(alike))]))
    if all(np.isclose(angle, HALF) for angle, _ in found):
        found = []
    return np.stack([np.eye(4), *(T for _, T in found)])
