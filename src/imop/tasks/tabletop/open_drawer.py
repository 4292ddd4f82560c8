"""Open one of three drawers."""

# ruff: noqa: D102 (the methods are described in Task)
from collections.abc import Sequence
from typing import Any

import numpy as np

from imop.sim.parts.cabinet import CabinetShape, drawer_cabinet
from imop.sim.parts.shapes import add_to
from imop.sim.world import World
from imop.tasks.colors import random_color
from imop.tasks.grasps import backed_off, from_front, shifted
from imop.tasks.layout import Area, Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint

LEVELS = ("bottom", "middle", "top")
PULL = 0.15
_OPEN = 0.12
_PITCH = np.radians(8.0)


class OpenDrawer(TableTask):
    """Grasp the bar of the variation's drawer and pull straight out."""

    name = "tabletop/open_drawer"
    variations = len(LEVELS)

    def instructions(self, variation: int) -> tuple[str, ...]:
        level = LEVELS[variation]
        return (
            f"open the {level} drawer",
            f"grip the {level} handle and pull the {level} drawer open",
            f"slide the {level} drawer open",
        )

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        self.drawer = f"cabinet/drawer{variation}"
        self.graspable = (self.drawer,)
        self.shape = CabinetShape(
            width=rng.uniform(0.26, 0.34),
            depth=rng.uniform(0.20, 0.24),
            drawer_height=rng.uniform(0.095, 0.115),
            handle_width=rng.uniform(0.09, 0.14),
        )
        wood, front = random_color(rng, 0.3), random_color(rng, 0.3)
        add_to(spec, "cabinet", drawer_cabinet(self.shape, wood, front, random_color(rng, 0.0, 0.3)))

    def items(self) -> Sequence[Item]:
        x, y = self.shape.depth / 2, self.shape.width / 4
        case = tuple((0.0, side * y, float(np.hypot(x, y))) for side in (-1, 1))
        way = tuple((x + out, side, 0.08) for out in (0.06, 0.16, 0.26) for side in (-0.06, 0.06))
        # The arm reaches handles that look towards it, up to a right angle to both sides.
        area, yaw = Area((0.1, 0.5), (-0.3, 0.3)), (np.pi / 2, 3 * np.pi / 2)
        return [Item("cabinet/body", case + way, area=area, yaw=yaw)]

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        grasp = from_front((-0.003, 0, 0), _PITCH)
        return [
            Waypoint(self.drawer, backed_off(grasp, 0.09), gripper_open=True),
            Waypoint(self.drawer, grasp, gripper_open=False, allow_collisions=True, linear=True),
            Waypoint(
                self.drawer,
                shifted(grasp, (PULL, 0, 0)),
                gripper_open=False,
                allow_collisions=True,
                linear=True,
            ),
        ]

    def success(self, world: World) -> bool:
        return world.joint(self.drawer) > _OPEN
