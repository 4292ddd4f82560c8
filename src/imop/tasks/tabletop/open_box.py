"""Open the lid of a box."""

# ruff: noqa: D102 (the methods are described in Task)
from collections.abc import Sequence
from typing import Any

import numpy as np

from imop.sim.parts.hinged_box import TAB_OUT, BoxShape, hinged_box
from imop.sim.parts.shapes import add_to
from imop.sim.world import World
from imop.tasks.colors import random_color
from imop.tasks.grasps import backed_off, from_front
from imop.tasks.layout import Area, Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint

_PITCH = np.radians(20.0)
_ARC = np.radians((20.0, 40.0, 60.0, 80.0, 98.0))
_OPEN = np.radians(85.0)


class OpenBox(TableTask):
    """Grasp the tab at the lid's edge and swing the lid up along an arc, until it leans back."""

    name = "tabletop/open_box"
    graspable = ("box/lid",)

    def instructions(self, variation: int) -> tuple[str, ...]:
        return ("open the box", "grip the tab and swing the lid of the box open", "lift the hinged lid")

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        self.shape = BoxShape(
            depth=rng.uniform(0.13, 0.18), width=rng.uniform(0.18, 0.26), height=rng.uniform(0.12, 0.15)
        )
        colors = [random_color(rng, 0.25), random_color(rng, 0.25), random_color(rng, 0.0, 0.3)]
        add_to(spec, "box", hinged_box(self.shape, *colors))

    def items(self) -> Sequence[Item]:
        x, y = self.shape.depth / 2, self.shape.width / 4
        case = tuple((0.0, side * y, float(np.hypot(x, y))) for side in (-1, 1))
        way = tuple((x + TAB_OUT + out, 0.0, 0.06) for out in (0.03, 0.12))
        # The arm reaches tabs that look towards it, as with drawers.
        area, yaw = Area((0.15, 0.45), (-0.3, 0.3)), (np.radians(110.0), np.radians(250.0))
        return [Item("box/body", case + way, area=area, yaw=yaw)]

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        grasp = from_front((0.003, 0, 0), _PITCH)
        return [
            Waypoint("box/lid", backed_off(grasp, 0.08), gripper_open=True),
            Waypoint("box/lid", grasp, gripper_open=False, allow_collisions=True, linear=True),
            *(
                Waypoint("box/body", self.shape.tab(angle) @ grasp, False, allow_collisions=True, linear=True)
                for angle in _ARC
            ),
        ]

    def success(self, world: World) -> bool:
        return bool(world.joint("box/lid") > _OPEN)
