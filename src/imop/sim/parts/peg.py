"""A ring with a grip, and an upright peg that it goes over."""

from dataclasses import dataclass
from typing import Any

import mujoco

from imop.sim.parts import lathe
from imop.sim.parts.shapes import PLASTIC, WOOD, Color, box, cylinder, part, rgba

PLATE = 0.012
"""Thickness of the plate under a peg, metres."""
GRIP_HEIGHT = 0.022
_GRIP_LENGTH, _GRIP_WIDTH = 0.042, 0.012


@dataclass(frozen=True)
class RingShape:
    """Sizes of a ring and of the peg that fits it, metres.

    Attributes:
        hole: inner radius.
        width: from the inner to the outer radius.
        height: of the ring.
        peg_radius: of the peg.
        peg_height: of the peg's top above the table.
    """

    hole: float
    width: float
    height: float
    peg_radius: float
    peg_height: float

    @property
    def outer(self) -> float:
        """Outer radius of the ring."""
        return self.hole + self.width

    @property
    def grip(self) -> float:
        """From the ring's axis to the middle of the grip."""
        return self.outer + _GRIP_LENGTH / 2


def ring(shape: RingShape, color: Color, grip_color: Color) -> Any:
    """A ring that moves freely; frame: centre of its underside, grip along +x."""
    spec, body = part()
    profile = [(shape.outer, 0.0), (shape.outer, shape.height)]
    lathe.shell(spec, body, "ring", profile, shape.width, color, PLASTIC, segments=20)
    near, far, y = shape.outer - 0.004, shape.outer + _GRIP_LENGTH, _GRIP_WIDTH / 2
    box(body, (near, -y, 0), (far, y, GRIP_HEIGHT), grip_color, PLASTIC)
    return spec


def peg(shape: RingShape, color: Color, plate_color: Color) -> Any:
    """A peg fixed on a plate; frame: the peg's axis at the underside, the plate's longer end towards -x."""
    spec, body = part(fixed=True)
    x, y = shape.outer + 0.02, shape.outer + 0.002
    box(body, (-x, -y, 0), (shape.outer, y, PLATE), plate_color, WOOD)
    tip = shape.peg_height - shape.peg_radius
    cylinder(body, shape.peg_radius, PLATE, tip, color, PLASTIC)
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        pos=[0, 0, tip],
        size=[shape.peg_radius, 0, 0],
        rgba=rgba(color),
        density=PLASTIC,
    )
    return spec
