"""Books, and a shelf with books in it and one free place."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from imop.sim.parts.shapes import WOOD, Color, box, part

BOARD = 0.014
PLINTH = 0.03
_COVER = 0.0025
_PAPER = (0.93, 0.9, 0.82)
_DENSITY = 500.0


@dataclass(frozen=True)
class BookShape:
    """Sizes in metres: `thickness` along y, `depth` from the spine along x, `height` along z."""

    thickness: float
    depth: float
    height: float


def _add_book(body: Any, shape: BookShape, lower: tuple[float, float, float], color: Color) -> None:
    """A book standing with its spine to +x; `lower` is its corner of the least coordinates."""
    x, y, z = lower
    far, side, top = x + shape.depth, y + shape.thickness, z + shape.height
    box(body, (x, y, z), (far, y + _COVER, top), color, _DENSITY)
    box(body, (x, side - _COVER, z), (far, side, top), color, _DENSITY)
    box(body, (far - _COVER, y + _COVER, z), (far, side - _COVER, top), color, _DENSITY)
    inner = (x + 0.004, y + _COVER, z + 0.004)
    box(body, inner, (far - _COVER, side - _COVER, top - 0.004), _PAPER, _DENSITY)


def book(shape: BookShape, color: Color) -> Any:
    """A closed book that moves freely and stands upright; frame: middle of its top, +x to its spine."""
    spec, body = part()
    lower = (-shape.depth / 2, -shape.thickness / 2, -shape.height)
    _add_book(body, shape, lower, color)
    return spec


@dataclass(frozen=True)
class ShelfShape:
    """A low shelf, open above, in which books stand side by side; metres.

    Attributes:
        left: books on the -y side of the free place, outermost first.
        right: books on its +y side, nearest first.
        free: width of the free place.
        depth: of the shelf.
        height: of its end boards above the board that the books stand on.
    """

    left: tuple[BookShape, ...]
    right: tuple[BookShape, ...]
    free: float
    depth: float
    height: float

    @property
    def left_end(self) -> float:
        """Outer side of the outermost book on this side, along y; the free place is around 0."""
        return -self.free / 2 - sum(b.thickness for b in self.left)

    @property
    def right_end(self) -> float:
        """Outer side of the outermost book on the other side."""
        return self.free / 2 + sum(b.thickness for b in self.right)


def bookshelf(shape: ShelfShape, color: Color, book_colors: list[Color]) -> Any:
    """A fixed shelf that opens towards +x and upwards; frame: floor of the free place's middle, +z up."""
    spec, body = part(fixed=True)
    x, low, high = shape.depth / 2, shape.left_end, shape.right_end
    base = -BOARD - PLINTH
    box(body, (-x, low - BOARD, -BOARD), (x, high + BOARD, 0), color, WOOD)
    box(body, (-x, low, base), (x - 0.02, high, -BOARD), color, WOOD)
    for y in (low - BOARD, high):
        box(body, (-x, y, base), (x, y + BOARD, shape.height), color, WOOD)
    box(body, (-x, low, 0), (BOARD - x, high, 0.6 * shape.height), color, WOOD)
    colors = iter(book_colors)
    for books, start in ((shape.left, low), (shape.right, shape.free / 2)):
        edges = np.cumsum([start, *(b.thickness for b in books)])
        for of, y in zip(books, edges[:-1], strict=True):
            _add_book(body, of, (x - 0.004 - of.depth, float(y), 0.0), next(colors))
    return spec
