"""A bowl."""

from typing import Any

import numpy as np

from imop.sim.parts import lathe
from imop.sim.parts.shapes import PLASTIC, Color, cylinder, part

WALL = 0.004
_FOOT = 0.5
"""Radius of the foot as a fraction of the rim's."""


def bowl(radius: float, depth: float, color: Color) -> Any:
    """A round bowl that moves freely; frame: centre of the opening, +z up.

    Args:
        radius: outer, at the rim, metres.
        depth: from the rim to what the bowl stands on, metres.
        color: of all of it.
    """
    spec, body = part()
    cylinder(body, _FOOT * radius, -depth, WALL - depth, color, 2 * PLASTIC)
    angle = np.linspace(0.0, np.pi / 2, 4)
    foot, rise = _FOOT * radius, depth - WALL
    wall = [(foot + (radius - foot) * np.sin(a), -rise * np.cos(a)) for a in angle]
    lathe.shell(spec, body, "wall", wall, WALL, color, 2 * PLASTIC)
    return spec
