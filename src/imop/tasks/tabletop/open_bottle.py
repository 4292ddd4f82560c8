"""Screw the cap off a bottle."""

# ruff: noqa: D102 (the methods are described in Task)
from collections.abc import Sequence
from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.parts.bottle import BottleShape, bottle, cap
from imop.sim.parts.jar import DROP, TOP, TURN
from imop.sim.parts.shapes import add_to
from imop.sim.world import World
from imop.tasks.colors import random_color
from imop.tasks.grasps import backed_off, from_above, shifted
from imop.tasks.layout import Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint

_SLACK = 0.0003
_LIFT, _OFF = 0.12, 0.06
"""How far the expert lifts the cap, and how far it must be from its place to be off, metres."""


class OpenBottle(TableTask):
    """Grasp the cap from above, turn it a quarter, lift it. Done when it is 6 cm from its place."""

    name = "tabletop/open_bottle"
    graspable = ("cap/body",)

    def instructions(self, variation: int) -> tuple[str, ...]:
        return ("open the bottle", "screw the cap off the bottle and lift it")

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        neck, radius = rng.uniform(0.014, 0.020), rng.uniform(0.032, 0.045)
        shoulder = rng.uniform(0.02, 0.05)
        self.shape = BottleShape(neck, radius, rng.uniform(0.12, 0.18), shoulder)
        add_to(spec, "bottle", bottle(self.shape, random_color(rng), random_color(rng, 0.4)))
        add_to(spec, "cap", cap(self.shape, random_color(rng), random_color(rng, 0.0, 0.3)))

    def items(self) -> Sequence[Item]:
        return [Item("bottle/body", ((0, 0, 0.075),), self.shape.height)]

    def arrange(self, world: World, rng: np.random.Generator) -> None:
        tight = se3.make(se3.euler(z=-TURN), (0, 0, TOP + _SLACK))
        world.set_free_pose("cap/body", world.pose("bottle/body") @ tight)

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        grasp = from_above((0, 0, -0.013))
        loose = se3.make(se3.euler(z=TURN), (0, 0, DROP)) @ grasp
        return [
            Waypoint("cap/body", backed_off(grasp, 0.10), gripper_open=True),
            Waypoint("cap/body", grasp, gripper_open=False, allow_collisions=True, linear=True),
            Waypoint("cap/body", loose, gripper_open=False, allow_collisions=True, linear=True),
            Waypoint("cap/body", shifted(grasp, (0, 0, _LIFT)), False, allow_collisions=True, linear=True),
        ]

    def success(self, world: World) -> bool:
        T_bottle_cap = se3.invert(world.pose("bottle/body")) @ world.pose("cap/body")
        return bool(np.linalg.norm(T_bottle_cap[:3, 3] - (0, 0, TOP)) > _OFF)
