"""Put a book into the free place of a shelf."""

# ruff: noqa: D102 (the methods are described in Task)
from collections.abc import Sequence
from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.parts.bookshelf import BOARD, PLINTH, BookShape, ShelfShape, book, bookshelf
from imop.sim.parts.shapes import add_to
from imop.sim.parts.solids import block
from imop.sim.world import World
from imop.tasks.colors import NAMED, random_color
from imop.tasks.grasps import backed_off, from_above, shifted
from imop.tasks.layout import Area, Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint

COLORS = ("red", "blue", "yellow", "purple", "teal")
_PLAY = 0.012
"""How much wider the free place is than the book."""
_DEPTH = 0.02
"""How far the finger ends are below the top of the grasped book."""
_ROOM = 0.09


class BookInShelf(TableTask):
    """Grasp the book of the variation's colour and lower it into the gap; another book distracts."""

    name = "tabletop/book_in_shelf"
    told_by_color = True
    variations = len(COLORS)
    graspable = ("book/body", "other/body")

    def instructions(self, variation: int) -> tuple[str, ...]:
        color = COLORS[variation]
        return (
            f"put the {color} book into the shelf",
            f"slide the {color} book into the free slot of the bookshelf",
            f"fill the gap in the row of books with the {color} book",
        )

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        color = COLORS[variation]
        depth = rng.uniform(0.10, 0.13)
        self.book = BookShape(rng.uniform(0.028, 0.042), depth, rng.uniform(0.155, 0.18))
        # Its neighbours are lower, so that the fingers have room above them.
        lowest, highest = 0.7 * self.book.height - 0.005, self.book.height - _DEPTH - 0.02
        neighbours = [
            BookShape(rng.uniform(0.018, 0.035), rng.uniform(0.8, 1.0) * depth, rng.uniform(lowest, highest))
            for _ in range(int(rng.integers(3, 6)))
        ]
        split = int(rng.integers(1, len(neighbours)))
        self.shelf = ShelfShape(
            left=tuple(neighbours[:split]),
            right=tuple(neighbours[split:]),
            free=self.book.thickness + _PLAY,
            depth=depth + BOARD + 0.012,
            height=0.6 * self.book.height,
        )
        wood = random_color(rng, 0.25)
        add_to(spec, "shelf", bookshelf(self.shelf, wood, [random_color(rng) for _ in neighbours]))
        add_to(spec, "book", book(self.book, NAMED[color]))
        other = str(rng.choice([c for c in COLORS if c != color]))
        add_to(spec, "other", book(self.book, NAMED[other]))
        size = (self.book.depth, 0.06, 0.05)
        add_to(spec, "box", block(size, NAMED[color]))

    def items(self) -> Sequence[Item]:
        x = self.shelf.depth / 2
        low, high = self.shelf.left_end - BOARD, self.shelf.right_end + BOARD
        radius = x + 0.01
        row = tuple((0.0, float(y), radius) for y in np.linspace(low + 0.8 * x, high - 0.8 * x, 3))
        return [
            Item("shelf/body", row, BOARD + PLINTH, Area((0.1, 0.45), (-0.32, 0.32))),
            Item("book/body", ((0, 0, _ROOM),), self.book.height),
            Item("other/body", ((0, 0, _ROOM),), self.book.height),
            Item("box/body", ((0, 0, self.book.depth / 2 + 0.015),), 0.05),
        ]

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        grasp = from_above((0, 0, -_DEPTH))
        place = from_above((-0.004 + (self.shelf.depth - self.book.depth) / 2, 0, self.book.height - _DEPTH))
        above = shifted(place, (0, 0, self.book.height))
        return [
            Waypoint("book/body", backed_off(grasp, 0.08), gripper_open=True),
            Waypoint("book/body", grasp, gripper_open=False, allow_collisions=True, linear=True),
            Waypoint("book/body", shifted(grasp, (0, 0, 0.24)), False, allow_collisions=True, linear=True),
            Waypoint("shelf/body", above, gripper_open=False),
            Waypoint("shelf/body", shifted(place, (0, 0, 0.002)), True, allow_collisions=True, linear=True),
        ]

    def success(self, world: World) -> bool:
        T = se3.invert(world.pose("shelf/body")) @ world.pose("book/body")
        standing = abs(T[2, 3] - self.book.height) < 0.01 and T[2, 2] > np.cos(0.1)
        within = abs(T[1, 3]) < _PLAY and abs(T[0, 3]) < self.shelf.depth / 2
        return not world.held and bool(standing and within)
