"""Shut a laptop."""

# ruff: noqa: D102 (the methods are described in Task)
from collections.abc import Sequence
from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.parts.laptop import COVER, GAP, LaptopShape, laptop
from imop.sim.parts.shapes import add_to
from imop.sim.world import World
from imop.tasks.colors import random_color
from imop.tasks.grasps import from_above
from imop.tasks.layout import Area, Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint
from imop.types import FloatArray

_SHUT = np.radians(6.0)
_BELOW_EDGE = 0.04
"""How far below the screen's free edge the fingers push."""
_HALF_WAY = np.radians(50.0)
_FINGER = 0.01
_APPROACH = 0.045
_LEAN = np.radians(107.0)
"""Angle of the screen at which the fingers first point straight down."""


class CloseLaptop(TableTask):
    """Push the screen from behind with closed fingers, forwards and down, until it lies on the keys."""

    name = "tabletop/close_laptop"

    def instructions(self, variation: int) -> tuple[str, ...]:
        return ("close the laptop", "shut the laptop's lid", "push the screen down onto the keyboard")

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        self.shape = LaptopShape(
            width=rng.uniform(0.22, 0.30), depth=rng.uniform(0.16, 0.20), height=rng.uniform(0.014, 0.02)
        )
        grey = rng.uniform(0.02, 0.25)
        keys = (grey, grey, grey)
        add_to(spec, "laptop", laptop(self.shape, random_color(rng, 0.35), keys, random_color(rng, 0.2, 0.7)))

    def items(self) -> Sequence[Item]:
        x, y = self.shape.depth / 2, self.shape.width / 4
        radius = float(np.hypot(x, y))
        base = tuple((0.0, side * y, radius) for side in (-1, 1))
        return [Item("laptop/body", (*base, (-x - 0.05, 0, 0.09)), area=Area((0.1, 0.42), (-0.3, 0.3)))]

    def arrange(self, world: World, rng: np.random.Generator) -> None:
        world.set_joint("laptop/screen", rng.uniform(np.radians(95.0), np.radians(120.0)))

    def _push(self, angle: float, clearance: float) -> FloatArray:
        """T_body_gripper (4, 4): upright, the finger ends `clearance` off the screen at `angle`."""
        along = self.shape.depth - _BELOW_EDGE
        away = COVER + clearance + _FINGER * np.sin(angle)
        x = along * np.cos(angle) - away * np.sin(angle) - self.shape.depth / 2
        z = along * np.sin(angle) + away * np.cos(angle) + self.shape.height + GAP
        return from_above((x, 0, z), np.pi)

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        behind = (self.shape.depth - _BELOW_EDGE, 0, COVER + _FINGER + _APPROACH)
        upright = se3.make(se3.euler(y=_LEAN), behind) @ from_above(yaw=np.pi)
        T_world_body, T_screen_world = world.pose("laptop/body"), se3.invert(world.pose("laptop/screen"))
        shut = T_screen_world @ T_world_body @ self._push(0.0, -0.001)
        return [
            Waypoint("laptop/screen", upright, gripper_open=False),
            Waypoint("laptop/body", self._push(_HALF_WAY, 0.0), False, allow_collisions=True, linear=True),
            Waypoint("laptop/screen", shut, gripper_open=False, allow_collisions=True, linear=True),
        ]

    def success(self, world: World) -> bool:
        return bool(world.joint("laptop/screen") < _SHUT)
