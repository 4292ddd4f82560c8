"""Put an item into a shelf."""

# ruff: noqa: D102 (the methods are described in Task)
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.parts.grocery import GROCERIES, grocery
from imop.sim.parts.rack import BOARD, FLOOR, rack
from imop.sim.parts.shapes import add_to
from imop.sim.world import World
from imop.tasks.colors import random_color
from imop.tasks.grasps import backed_off, from_above, from_side, shifted
from imop.tasks.layout import Area, Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint
from imop.types import FloatArray

KINDS = tuple(kind for kind in GROCERIES if 0.06 < kind.height < 0.15)
_GRASP_DEPTH = 0.02
_INSIDE, _FRONT = 0.09, 0.22
"""How deep the hand goes in, and how far before the boards it turns what it holds."""
_ABOVE_BOARD = 0.10
_ROOM = 0.05
"""Around an item's width, for the fingers."""


def _level(x: float) -> FloatArray:
    """T_shelf_gripper (4, 4): level, pointing into the shelf; tip at `x`."""
    return se3.make(se3.euler(z=np.pi)) @ from_side((-x, 0.0, _ABOVE_BOARD))


class ItemInShelf(TableTask):
    """Pick the item from above by its top, and lay it onto the lower board, bottom first.

    In every instance it is another carton, can or jar, in other proportions and colours.
    """

    name = "tabletop/item_in_shelf"
    graspable = ("item/body",)
    sizes = (0.85, 1.1)

    def instructions(self, variation: int) -> tuple[str, ...]:
        return ("put the item in the shelf", "lay the item onto the lower board of the shelf")

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        kind = KINDS[int(rng.integers(len(KINDS)))]
        across, up = rng.uniform(0.85, 1.05), rng.uniform(0.9, 1.15)
        self.kind = replace(
            kind,
            length=across * kind.length,
            width=across * kind.width,
            height=up * kind.height,
            color=random_color(rng),
        )
        self.width, self.depth = rng.uniform(0.28, 0.34), rng.uniform(0.22, 0.26)
        self.height = rng.uniform(0.23, 0.26)
        wood = random_color(rng, 0.3)
        add_to(spec, "shelf", rack(self.width, self.depth, self.height, wood, random_color(rng, 0.3)))
        add_to(spec, "item", grocery(self.kind))

    def items(self) -> Sequence[Item]:
        side, radius = self.width / 2 + BOARD - 0.06, self.depth / 2 + 0.01
        boards = tuple((-self.depth / 2, y, radius) for y in (-side, 0.0, side))
        approach = tuple((x, 0.0, 0.08) for x in (0.08, 0.19))
        area, facing = Area((0.14, 0.42), (-0.32, 0.32)), (np.pi - 0.9, np.pi + 0.9)
        long = max(self.kind.length / 2, self.kind.width / 2 + _ROOM)
        return [
            Item("shelf/body", boards + approach, FLOOR, area, facing),
            Item("item/body", ((0, 0, long),), self.kind.height),
        ]

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        grasp = from_above((0, 0, -_GRASP_DEPTH))
        lifted = shifted(grasp, (0, 0, 0.15))
        return [
            Waypoint("item/body", backed_off(grasp, 0.10), gripper_open=True),
            Waypoint("item/body", grasp, gripper_open=False, allow_collisions=True, linear=True),
            Waypoint("item/body", lifted, gripper_open=False, allow_collisions=True, linear=True),
            Waypoint("shelf/body", _level(_FRONT), gripper_open=False),
            Waypoint("shelf/body", _level(-_INSIDE), True, allow_collisions=True, linear=True),
        ]

    def success(self, world: World) -> bool:
        T_shelf_item = se3.invert(world.pose("shelf/body")) @ world.pose("item/body")
        middle = se3.apply(T_shelf_item, np.array([0, 0, -self.kind.height / 2]))
        lower = np.array([-self.depth, -self.width / 2, 0.0])
        upper = np.array([0.0, self.width / 2, self.height])
        return not world.held and bool(np.all((middle > lower) & (middle < upper)))
