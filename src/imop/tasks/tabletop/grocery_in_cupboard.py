"""Put a grocery into the cupboard."""

# ruff: noqa: D102 (the methods are described in Task)
from collections.abc import Sequence
from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.parts import cupboard
from imop.sim.parts.grocery import GROCERIES, grocery
from imop.sim.parts.shapes import add_to
from imop.sim.world import World
from imop.tasks.colors import random_color
from imop.tasks.grasps import backed_off, from_above, shifted
from imop.tasks.layout import Area, Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint
from imop.types import FloatArray

_GRASP_DEPTH = 0.02
_INSIDE = 0.11
_FRONT = 0.23
"""How far before the opening the hand turns what it holds: the longest carton is in the air there."""
_ABOVE_FLOOR = 0.105
_ROOM = 0.05
"""Around a grocery's width, for the fingers."""


def _level(x: float) -> FloatArray:
    """T_cupboard_gripper (4, 4): level, pointing into the cupboard, closing sideways; tip at `x`."""
    z, x_axis = np.array([-1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    R = np.stack([x_axis, np.cross(z, x_axis), z], axis=1)
    return se3.make(R, (x, 0.0, _ABOVE_FLOOR))


class GroceryInCupboard(TableTask):
    """Pick the variation's grocery from above by its top, and lay it into the cupboard, bottom first.

    Frames and grasps are the same for all groceries, so what was shown with one can be tried with another.
    The cupboard's width and colours and the shade of the pack belong to the instance.
    """

    name = "tabletop/grocery_in_cupboard"
    variations = len(GROCERIES)
    graspable = ("grocery/body",)

    def instructions(self, variation: int) -> tuple[str, ...]:
        item = GROCERIES[variation].name
        return (
            f"put the {item} in the cupboard",
            f"place the {item} into the cupboard",
            f"pick up the {item} and put it away in the cupboard",
        )

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        self.kind = GROCERIES[variation]
        wood = np.asarray(random_color(rng, 0.35))
        self.width = rng.uniform(0.28, 0.32)
        add_to(spec, "cupboard", cupboard.open_cupboard(self.width, tuple(wood), tuple(0.8 * wood)))
        shade = rng.uniform(-0.06, 0.06, size=3)
        add_to(spec, "grocery", grocery(self.kind, tuple(shade)))

    def items(self) -> Sequence[Item]:
        deep, wide = cupboard.DEPTH + cupboard.BOARD, self.width / 2 + cupboard.BOARD
        back, side = -deep + 0.075, wide - 0.075
        case = tuple((x, y, 0.106) for x in (back, -0.075) for y in (-side, 0.0, side))
        approach = tuple((x, 0.0, 0.08) for x in (0.08, 0.20))
        area, facing = Area((0.16, 0.45), (-0.32, 0.32)), (np.pi - 0.9, np.pi + 0.9)
        long = max(self.kind.length / 2, self.kind.width / 2 + _ROOM)
        return [
            Item("cupboard/body", case + approach, cupboard.MOUTH_HEIGHT, area, facing),
            Item("grocery/body", ((0, 0, long),), self.kind.height),
        ]

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        grasp = from_above((0, 0, -_GRASP_DEPTH))
        lifted = shifted(grasp, (0, 0, 0.15))
        return [
            Waypoint("grocery/body", backed_off(grasp, 0.10), gripper_open=True),
            Waypoint("grocery/body", grasp, gripper_open=False, allow_collisions=True, linear=True),
            Waypoint("grocery/body", lifted, gripper_open=False, allow_collisions=True, linear=True),
            Waypoint("cupboard/body", _level(_FRONT), gripper_open=False),
            Waypoint("cupboard/body", _level(-_INSIDE), True, allow_collisions=True, linear=True),
        ]

    def success(self, world: World) -> bool:
        T_cupboard_grocery = se3.invert(world.pose("cupboard/body")) @ world.pose("grocery/body")
        ends = se3.apply(T_cupboard_grocery, np.array([[0, 0, 0], [0, 0, -self.kind.height]]))
        lower = np.array([-cupboard.DEPTH, -self.width / 2, -0.002])
        upper = np.array([0.0, self.width / 2, cupboard.HEIGHT])
        return not world.held and bool(np.all((ends > lower) & (ends < upper)))
