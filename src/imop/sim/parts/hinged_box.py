"""A box whose lid turns on a hinge."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.parts.hinge import hinge
from imop.sim.parts.shapes import WOOD, Color, box, part
from imop.types import FloatArray

WALL = 0.008
LID = 0.01
TAB_OUT = 0.024
"""How far the middle of the lid's tab stands out from the front."""
WIDEST = float(np.radians(120.0))
_TAB = (0.012, 0.03, 0.005)
_GAP = 0.001


@dataclass(frozen=True)
class BoxShape:
    """Outer sizes in metres; `depth` is from the hinge to the front, `height` without the lid."""

    depth: float
    width: float
    height: float

    @property
    def arm(self) -> float:
        """From the hinge's axis to the middle of the tab."""
        return self.depth + TAB_OUT

    def tab(self, angle: float) -> FloatArray:
        """T_body_lid (4, 4) with the lid open by `angle`."""
        axis = (-self.depth / 2, 0.0, self.height + _GAP + LID / 2)
        return se3.make(se3.euler(y=-angle), axis) @ se3.make(p=(self.arm, 0.0, 0.0))


def hinged_box(shape: BoxShape, color: Color, lid_color: Color, tab_color: Color) -> Any:
    """A fixed box that opens away from +x; frame: centre of its base.

    The body "lid" turns on the hinge "lid", 0 being shut; its frame is the middle of the tab at its front
    edge, +z up when shut.
    """
    spec, body = part(fixed=True)
    x, y, z = shape.depth / 2, shape.width / 2, shape.height
    box(body, (-x, -y, 0), (x, y, WALL), color, WOOD)
    for side in (-1, 1):
        near, far = sorted((side * x, side * (x - WALL)))
        box(body, (near, -y, WALL), (far, y, z), color, WOOD)
        inner, outer = sorted((side * y, side * (y - WALL)))
        box(body, (WALL - x, inner, WALL), (x - WALL, outer, z), color, WOOD)
    lid = body.add_body(name="lid", pos=shape.tab(0.0)[:3, 3])
    hinge(lid, "lid", (0, -1, 0), (0.0, WIDEST), pos=(-shape.arm, 0, 0), friction=0.05)
    box(lid, (-shape.arm, -y, -LID / 2), (-TAB_OUT, y, LID / 2), lid_color, WOOD)
    out = _TAB[0]
    box(lid, (-out, -_TAB[1], -_TAB[2]), _TAB, tab_color, WOOD)
    box(lid, (-TAB_OUT, -0.012, -0.003), (-out, 0.012, 0.003), tab_color, WOOD)
    spec.add_exclude(bodyname1="body", bodyname2="lid")
    return spec
