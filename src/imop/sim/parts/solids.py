"""Small everyday solids: cubes, boxes, cans, balls, bowls; targets and clutter."""

from typing import Any

import numpy as np

from imop.sim.parts import lathe
from imop.sim.parts.shapes import PLASTIC, WOOD, Color, box, cylinder, part

SHAPES = ("box", "can", "ball", "cone", "bowl")


def block(size: tuple[float, float, float], color: Color, fixed: bool = False) -> Any:
    """A box that moves freely unless it is `fixed`; frame: centre of its upper face."""
    spec, body = part(fixed)
    x, y, z = size
    box(body, (-x / 2, -y / 2, -z), (x / 2, y / 2, 0), color, WOOD)
    return spec


def trinket(shape: str, radius: float, height: float, color: Color) -> Any:
    """One of `SHAPES`, for clutter; it moves freely. Frame: centre of its base.

    `height` does not apply to balls.
    """
    spec, body = part()
    if shape == "box":
        x = radius / np.sqrt(2)
        box(body, (-x, -0.8 * x, 0), (x, 0.8 * x, height), color, PLASTIC)
    elif shape == "can":
        cylinder(body, radius, 0, height, color, PLASTIC)
    elif shape == "ball":
        # A ball with a flat foot stays where it is put.
        angle = np.linspace(-np.pi / 3, np.pi / 2, 7)
        profile = [(radius * np.cos(a), radius * (np.sin(a) + np.sin(np.pi / 3))) for a in angle]
        lathe.solid(spec, body, "ball", profile, color, PLASTIC, segments=16)
    elif shape == "cone":
        lathe.solid(spec, body, "cone", [(radius, 0), (0.35 * radius, height)], color, PLASTIC)
    else:
        cylinder(body, 0.6 * radius, 0, 0.004, color, PLASTIC)
        lathe.shell(spec, body, "wall", [(0.6 * radius, 0.004), (radius, height)], 0.004, color, PLASTIC, 16)
    return spec
