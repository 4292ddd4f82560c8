"""A waste bin."""

from typing import Any

from imop.sim.parts import lathe
from imop.sim.parts.shapes import PLASTIC, Color, cylinder, part

WALL = 0.004


def waste_bin(bottom_radius: float, top_radius: float, height: float, color: Color, rim_color: Color) -> Any:
    """An open, tapered bin that moves freely; frame: centre of the opening, +z up."""
    spec, body = part()
    cylinder(body, bottom_radius, -height, WALL - height, color, PLASTIC * 2)
    wall = [(bottom_radius, WALL - height), (top_radius, -0.012)]
    lathe.shell(spec, body, "wall", wall, WALL, color, PLASTIC, segments=20)
    rim = [(top_radius + 0.003, -0.012), (top_radius + 0.003, 0.0)]
    lathe.shell(spec, body, "rim", rim, WALL + 0.003, rim_color, PLASTIC, segments=20)
    return spec
