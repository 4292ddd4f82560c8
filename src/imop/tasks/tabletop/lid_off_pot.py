"""Take the lid off a pot."""

# ruff: noqa: D102 (the methods are described in Task)
from collections.abc import Sequence
from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.parts.pot import PotShape, lid, pot
from imop.sim.parts.shapes import add_to
from imop.sim.world import World
from imop.tasks.colors import random_color
from imop.tasks.grasps import backed_off, from_above, shifted
from imop.tasks.layout import Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint

_LIFT = 0.15


class LidOffPot(TableTask):
    """Grasp the knob from above and lift. Done when the lid is held 8 cm above its place on the pot."""

    name = "tabletop/lid_off_pot"
    graspable = ("lid/body",)

    def instructions(self, variation: int) -> tuple[str, ...]:
        return ("take the lid off the pot", "grasp the knob and lift the lid off the pot", "open the pot")

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        self.shape = PotShape(
            radius=rng.uniform(0.075, 0.105),
            height=rng.uniform(0.07, 0.11),
            dome=rng.uniform(0.008, 0.02),
            knob_radius=rng.uniform(0.015, 0.022),
            knob_height=rng.uniform(0.024, 0.034),
        )
        dark = random_color(rng, 0.02, 0.3)
        add_to(spec, "pot", pot(self.shape, random_color(rng), dark))
        add_to(spec, "lid", lid(self.shape, random_color(rng, 0.4), dark))

    def items(self) -> Sequence[Item]:
        r = self.shape.radius
        return [Item("pot/body", ((0, 0, r + 0.005), (0, r + 0.015, 0.035), (0, -r - 0.015, 0.035)))]

    def arrange(self, world: World, rng: np.random.Generator) -> None:
        up = se3.make(p=(0, 0, self.shape.height + self.shape.knob_above_rim))
        world.set_free_pose("lid/body", world.pose("pot/body") @ up)

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        grasp = from_above((0, 0, -0.004))
        return [
            Waypoint("lid/body", backed_off(grasp, 0.10), gripper_open=True),
            Waypoint("lid/body", grasp, gripper_open=False, allow_collisions=True, linear=True),
            Waypoint(
                "lid/body",
                shifted(grasp, (0, 0, _LIFT)),
                gripper_open=False,
                allow_collisions=True,
                linear=True,
            ),
        ]

    def success(self, world: World) -> bool:
        on = self.shape.height + self.shape.knob_above_rim
        height = (se3.invert(world.pose("pot/body")) @ world.pose("lid/body"))[2, 3]
        return "lid/body" in world.held and bool(height > on + 0.08)
