"""A kitchen cupboard without a door."""

from typing import Any

from imop.sim.parts.shapes import WOOD, Color, box, part

HEIGHT, DEPTH = 0.23, 0.33
"""Of the inside, metres, along z and x."""
PLINTH = 0.10
"""Closed part below."""
BOARD = 0.012
MOUTH_HEIGHT = PLINTH + BOARD
"""Of the frame above what the cupboard stands on."""


def open_cupboard(width: float, color: Color, inner_color: Color) -> Any:
    """A fixed cupboard, `width` metres inside, open towards +x; frame: middle of the lower edge there."""
    spec, body = part(fixed=True)
    y, top = width / 2, HEIGHT + BOARD
    box(body, (-DEPTH - BOARD, -y - BOARD, -MOUTH_HEIGHT), (-0.02, y + BOARD, -BOARD), color, WOOD)
    box(body, (-DEPTH - BOARD, -y - BOARD, -BOARD), (0, y + BOARD, 0), inner_color, WOOD)
    box(body, (-DEPTH - BOARD, -y - BOARD, HEIGHT), (0, y + BOARD, top), color, WOOD)
    box(body, (-DEPTH - BOARD, -y - BOARD, 0), (-DEPTH, y + BOARD, HEIGHT), inner_color, WOOD)
    for side in (-1, 1):
        inner, outer = sorted((side * y, side * (y + BOARD)))
        box(body, (-DEPTH, inner, 0), (0, outer, HEIGHT), color, WOOD)
    return spec
