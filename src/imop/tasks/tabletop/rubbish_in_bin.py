"""Put the crumpled paper into the bin."""

# ruff: noqa: D102 (the methods are described in Task)
from collections.abc import Sequence
from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.parts.bin import waste_bin
from imop.sim.parts.paper import crumpled_paper, height
from imop.sim.parts.shapes import add_to
from imop.sim.parts.solids import trinket
from imop.sim.world import World
from imop.tasks.colors import random_color
from imop.tasks.grasps import backed_off, from_above, shifted
from imop.tasks.layout import Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint

_ROOM = 0.07
"""Around the paper, for the fingers."""


class RubbishInBin(TableTask):
    """Pick the paper among other small things from above and drop it into the bin."""

    name = "tabletop/rubbish_in_bin"
    graspable = ("paper/body",)

    def instructions(self, variation: int) -> tuple[str, ...]:
        return (
            "put the rubbish in the bin",
            "drop the crumpled paper into the bin",
            "pick up the paper and throw it away",
        )

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        self.top_radius = rng.uniform(0.08, 0.1)
        self.bin_height = rng.uniform(0.11, 0.17)
        self.paper_radius = rng.uniform(0.026, 0.033)
        bottom = rng.uniform(0.7, 0.9) * self.top_radius
        bin_part = waste_bin(
            bottom, self.top_radius, self.bin_height, random_color(rng), random_color(rng, 0, 0.3)
        )
        add_to(spec, "bin", bin_part)
        white = rng.uniform(0.85, 1.0)
        add_to(spec, "paper", crumpled_paper(self.paper_radius, rng, (white, white, 0.96 * white)))
        for i in range(2):
            red = (rng.uniform(0.7, 0.95), rng.uniform(0.05, 0.25), rng.uniform(0.05, 0.15))
            add_to(spec, f"tomato{i}", trinket("ball", rng.uniform(0.022, 0.03), 0, red))

    def items(self) -> Sequence[Item]:
        return [
            Item("bin/body", ((0, 0, self.top_radius + 0.01),), self.bin_height),
            Item("paper/body", ((0, 0, _ROOM),), height(self.paper_radius)),
            Item("tomato0/body", ((0, 0, 0.03),)),
            Item("tomato1/body", ((0, 0, 0.03),)),
        ]

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        grasp = from_above((0, 0, -0.006))
        return [
            Waypoint("paper/body", backed_off(grasp, 0.10), gripper_open=True),
            Waypoint("paper/body", grasp, gripper_open=False, allow_collisions=True, linear=True),
            Waypoint(
                "paper/body",
                shifted(grasp, (0, 0, 0.2)),
                gripper_open=False,
                allow_collisions=True,
                linear=True,
            ),
            Waypoint("bin/body", from_above((0, 0, 0.06)), gripper_open=True),
        ]

    def success(self, world: World) -> bool:
        p = (se3.invert(world.pose("bin/body")) @ world.pose("paper/body"))[:3, 3]
        inside = np.hypot(p[0], p[1]) < self.top_radius and -self.bin_height < p[2] < -0.03
        return not world.held and bool(inside)
