"""A shelf of two boards between two sides, open in front and behind."""

from typing import Any

from imop.sim.parts.shapes import WOOD, Color, box, part

BOARD = 0.012
PLINTH = 0.10
"""From what the shelf stands on to the lower board's underside."""
FLOOR = PLINTH + BOARD
"""Of the frame above what the shelf stands on."""


def rack(width: float, depth: float, height: float, color: Color, board_color: Color) -> Any:
    """A fixed shelf, open towards +x and -x; frame: middle of the lower board's front edge, on top of it.

    Args:
        width: inside, along y, metres.
        depth: of boards and sides, along x from 0 to -depth, metres.
        height: between the boards, metres.
        color: of the sides.
        board_color: of the boards.
    """
    spec, body = part(fixed=True)
    y, top = width / 2, height + BOARD
    for low in (-BOARD, height):
        box(body, (-depth, -y, low), (0, y, low + BOARD), board_color, WOOD)
    for side in (-1, 1):
        inner, outer = sorted((side * y, side * (y + BOARD)))
        box(body, (-depth, inner, -FLOOR), (0, outer, top), color, WOOD)
    # A rail below keeps the sides apart and holds nothing back.
    box(body, (-depth / 2 - BOARD, -y, -FLOOR), (-depth / 2, y, -BOARD), color, WOOD)
    return spec
