"""A cooking pot with two side handles, and its lid."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from imop.sim.parts import lathe
from imop.sim.parts.shapes import METAL, PLASTIC, Color, capsule, cylinder, part

WALL = 0.004
_LID_EDGE = 0.004
_LIP = 0.006


@dataclass(frozen=True)
class PotShape:
    """Sizes of a pot and of the lid that fits it, metres.

    Attributes:
        radius: outer radius of the wall.
        height: of the wall.
        dome: rise of the lid from its edge to the foot of the knob.
        knob_radius: largest radius of the knob.
        knob_height: of the knob.
    """

    radius: float
    height: float
    dome: float
    knob_radius: float
    knob_height: float

    @property
    def knob_above_rim(self) -> float:
        """From the pot's rim to the centre of the knob of the lid that lies on it."""
        return _LID_EDGE + self.dome + self.knob_height / 2


def pot(shape: PotShape, color: Color, handle_color: Color) -> Any:
    """An open pot that moves freely; frame: centre of the base, handles along +-y."""
    spec, body = part()
    cylinder(body, shape.radius, 0, WALL, color, METAL)
    wall = [(shape.radius, WALL), (shape.radius, shape.height)]
    lathe.shell(spec, body, "wall", wall, WALL, color, METAL)
    z = 0.75 * shape.height
    for side in (-1, 1):
        near, far = side * (shape.radius - WALL / 2), side * (shape.radius + 0.028)
        for x in (-0.026, 0.026):
            capsule(body, (x * 1.15, near, z), (x, far, z), 0.006, handle_color, PLASTIC)
        capsule(body, (-0.026, far, z), (0.026, far, z), 0.006, handle_color, PLASTIC)
    return spec


def lid(shape: PotShape, color: Color, knob_color: Color) -> Any:
    """A domed lid that moves freely; frame: centre of the knob, +z out of the pot."""
    spec, body = part()
    foot = -shape.knob_height / 2
    edge = foot - shape.dome
    outer = shape.radius + 0.004
    angle = np.linspace(0, np.pi / 2, 5)
    dome = [(outer, edge - _LID_EDGE)]
    dome += [(0.016 + (outer - 0.016) * np.cos(a), edge + shape.dome * np.sin(a)) for a in angle]
    lathe.solid(spec, body, "dome", dome, color, METAL / 3)
    # A lip inside the wall keeps the lid from sliding off.
    lip = shape.radius - WALL - 0.003
    cylinder(body, lip, edge - _LID_EDGE - _LIP, edge - _LID_EDGE, color, METAL / 3)
    neck, r, h = 0.6 * shape.knob_radius, shape.knob_radius, shape.knob_height
    knob = [(neck, foot), (r, foot + 0.35 * h), (r, foot + 0.8 * h), (0.7 * r, foot + h)]
    lathe.solid(spec, body, "knob", knob, knob_color, PLASTIC)
    return spec
