"""Put an item into one of three drawers, which has to be opened first."""

# ruff: noqa: D102 (the methods are described in Task)
from collections.abc import Sequence
from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.parts.cabinet import HANDLE_OUT, CabinetShape, drawer_cabinet
from imop.sim.parts.shapes import add_to
from imop.sim.parts.solids import block
from imop.sim.world import World
from imop.tasks.checks import rehearse
from imop.tasks.colors import random_color
from imop.tasks.grasps import backed_off, from_above, from_front, shifted
from imop.tasks.layout import Area, Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint
from imop.types import FloatArray

LEVELS = ("bottom", "middle", "top")
PULL = 0.15
_PITCH = np.radians(8.0)
_OPENING = 4
"""Number of steps that open the drawer."""
_OUT = 0.09
"""From the case's front to where the item is let go: clear of the handles of the drawers above."""
_ROOM = 0.065
"""Around the item, for the fingers."""


class ItemInDrawer(TableTask):
    """Pull the variation's drawer open, take the item from the table and drop it into the drawer."""

    name = "tabletop/item_in_drawer"
    variations = len(LEVELS)

    def instructions(self, variation: int) -> tuple[str, ...]:
        level = LEVELS[variation]
        return (
            f"put the item in the {level} drawer",
            f"open the {level} drawer and place the item inside of it",
            f"pull the {level} drawer open, pick up the item and drop it in",
        )

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        self.level = variation
        self.drawer = f"cabinet/drawer{variation}"
        self.graspable = (self.drawer, "item/body")
        self.shape = CabinetShape(
            width=rng.uniform(0.26, 0.32),
            depth=rng.uniform(0.20, 0.24),
            drawer_height=rng.uniform(0.09, 0.105),
            handle_width=rng.uniform(0.09, 0.14),
        )
        wood, front = random_color(rng, 0.3), random_color(rng, 0.3)
        add_to(spec, "cabinet", drawer_cabinet(self.shape, wood, front, random_color(rng, 0.0, 0.3)))
        self.size = (rng.uniform(0.045, 0.06), rng.uniform(0.03, 0.04), rng.uniform(0.03, 0.045))
        add_to(spec, "item", block(self.size, random_color(rng)))

    def items(self) -> Sequence[Item]:
        x, y = self.shape.depth / 2, self.shape.width / 4
        case = tuple((0.0, side * y, float(np.hypot(x, y))) for side in (-1, 1))
        way = tuple((x + out, side, 0.08) for out in (0.06, 0.16, 0.26) for side in (-0.06, 0.06))
        # The arm reaches handles that look towards it, up to a right angle to both sides.
        area, yaw = Area((0.1, 0.5), (-0.3, 0.3)), (np.pi / 2, 3 * np.pi / 2)
        return [
            Item("cabinet/body", case + way, area=area, yaw=yaw),
            Item("item/body", ((0, 0, _ROOM),), self.size[2]),
        ]

    @property
    def _T_cabinet_handle(self) -> FloatArray:
        """(4, 4) of the closed drawer's frame."""
        x = self.shape.depth / 2 + HANDLE_OUT
        return se3.make(p=(x, 0, self.shape.handle_height(self.level)))

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        handle = from_front((-0.003, 0, 0), _PITCH)
        grasp = from_above((0, 0, -0.018))
        # Where the drawer is after the pull, told from the cabinet, which never moves.
        pulled = self._T_cabinet_handle @ shifted(handle, (PULL, 0, 0))
        inside = self._T_cabinet_handle @ self._over_the_drawer
        cabinet, item = "cabinet/body", "item/body"
        return [
            Waypoint(self.drawer, backed_off(handle, 0.09), gripper_open=True),
            Waypoint(self.drawer, handle, gripper_open=False, allow_collisions=True, linear=True),
            Waypoint(cabinet, pulled, gripper_open=True, allow_collisions=True, linear=True),
            Waypoint(cabinet, backed_off(pulled, 0.09), True, allow_collisions=True, linear=True),
            Waypoint(item, backed_off(grasp, 0.10), gripper_open=True),
            Waypoint(item, grasp, gripper_open=False, allow_collisions=True, linear=True),
            Waypoint(item, shifted(grasp, (0, 0, 0.15)), False, allow_collisions=True, linear=True),
            Waypoint(cabinet, inside, gripper_open=True),
        ]

    def _problem(self, world: World) -> str:
        """As for any task, and the item's way has to be free when the drawer is open, too."""
        if problem := super()._problem(world):
            return problem
        world.set_joint(self.drawer, PULL)
        problem = rehearse(world, self.waypoints(world)[_OPENING:])
        world.set_joint(self.drawer, 0.0)
        return problem

    @property
    def _over_the_drawer(self) -> FloatArray:
        """Over the opened part in the closed drawer's frame, leaning away from the case."""
        lean = se3.euler(y=np.radians(35.0))
        p = (_OUT - HANDLE_OUT, 0, self.shape.drawer_height / 2 + 0.05)
        return se3.make(lean @ from_above()[:3, :3], p)

    def success(self, world: World) -> bool:
        p = (se3.invert(world.pose(self.drawer)) @ world.pose("item/body"))[:3, 3] - (0, 0, self.size[2] / 2)
        inside = -HANDLE_OUT - self.shape.depth < p[0] < -HANDLE_OUT and abs(p[1]) < self.shape.width / 2
        low = -self.shape.drawer_height / 2 < p[2] < self.shape.drawer_height / 2
        return not world.held and bool(inside and low)
