"""A laptop computer."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from imop.sim.parts.hinge import hinge
from imop.sim.parts.shapes import PLASTIC, Color, box, part

COVER = 0.009
"""Thickness of the screen."""
GAP = 0.002
"""Between the shut screen and the base."""
WIDEST = float(np.radians(135.0))
_DENSITY = 900.0
_HOLD = 0.45
"""Torque with which the hinge holds the screen wherever it is left, N m."""


@dataclass(frozen=True)
class LaptopShape:
    """Sizes in metres.

    Attributes:
        width: along the hinge.
        depth: from the hinge to the front.
        height: of the base.
    """

    width: float
    depth: float
    height: float

    @property
    def shut_height(self) -> float:
        """From the table to the top of the shut laptop."""
        return self.height + GAP + COVER


def laptop(shape: LaptopShape, color: Color, key_color: Color, glow: Color) -> Any:
    """A laptop that stays where it is; frame: centre of its underside, +x to the person in front of it.

    The body "screen" turns on the hinge "screen", an angle of 0 being shut. Its frame lies on the axis: +x to
    the screen's free edge, +z out of its back.
    """
    spec, body = part(fixed=True)
    x, y, z = shape.depth / 2, shape.width / 2, shape.height
    box(body, (-x, -y, 0), (x, y, z), color, PLASTIC)
    rows, raised = 4, 0.001
    pitch = 0.5 * shape.depth / rows
    for row in range(rows):
        at = -0.8 * x + row * pitch
        box(body, (at, -0.85 * y, z), (at + 0.75 * pitch, 0.85 * y, z + raised), key_color, PLASTIC)
    box(body, (0.45 * x, -0.3 * y, z), (0.85 * x, 0.3 * y, z + raised / 2), key_color, PLASTIC)
    axis = z + GAP
    screen = body.add_body(name="screen", pos=[-x, 0, axis])
    hinge(screen, "screen", (0, -1, 0), (0.0, WIDEST), friction=_HOLD)
    box(screen, (0.006, -y, 0), (shape.depth, y, COVER), color, _DENSITY)
    edge = 0.012
    box(screen, (edge + 0.006, edge - y, -0.0006), (shape.depth - edge, y - edge, 0), glow, _DENSITY)
    for side in (-0.7, 0.7):
        low, high = side * y - 0.015, side * y + 0.015
        box(screen, (-0.006, low, -0.001), (0.008, high, COVER), key_color, PLASTIC)
    spec.add_exclude(bodyname1="body", bodyname2="screen")
    return spec
