"""Screw the lid onto the jar of a colour."""

# ruff: noqa: D102 (the methods are described in Task)
from collections.abc import Sequence
from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.parts.jar import DROP, LID_HEIGHT, TOP, TURN, JarShape, jar, screw_lid
from imop.sim.parts.shapes import add_to
from imop.sim.parts.solids import trinket
from imop.sim.world import World
from imop.tasks.colors import NAMED, random_color
from imop.tasks.grasps import backed_off, from_above, shifted
from imop.tasks.layout import Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint

COLORS = tuple(NAMED)
_OTHERS = 2
_SLACK = 0.0003
_TIGHT = np.radians(60.0)


class CloseJar(TableTask):
    """Take the lid by its rim, set it on and turn it a quarter. Done when it is down, turned and released."""

    name = "tabletop/close_jar"
    told_by_color = True
    variations = len(COLORS)
    graspable = ("lid/body",)

    def instructions(self, variation: int) -> tuple[str, ...]:
        color = COLORS[variation]
        return (
            f"close the {color} jar",
            f"screw the lid onto the {color} jar",
            f"pick up the lid, put it on the {color} jar and turn it tight",
        )

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        neck = rng.uniform(0.020, 0.025)
        self.shape = JarShape(neck, neck + rng.uniform(0.010, 0.018), rng.uniform(0.075, 0.11))
        content, label = random_color(rng, 0.0, 0.4), random_color(rng, 0.7)
        color = COLORS[variation]
        add_to(spec, "jar", jar(self.shape, NAMED[color], content, label))
        others = rng.permutation([c for c in COLORS if c != color])
        for i in range(_OTHERS):
            add_to(spec, f"other{i}", jar(self.shape, NAMED[str(others[i])], content, label))
        add_to(spec, "decoy", trinket("box", 0.034, self.shape.height, NAMED[color]))
        grey = rng.uniform(0.4, 0.9)
        add_to(spec, "lid", screw_lid(self.shape, (grey, grey, grey), random_color(rng, 0.0, 0.3)))

    def items(self) -> Sequence[Item]:
        r, height = self.shape.radius, self.shape.height
        others = [Item(f"other{i}/body", ((0, 0, r + 0.01),), height) for i in range(_OTHERS)]
        return [
            Item("jar/body", ((0, 0, 0.08),), height),
            Item("lid/body", ((0, 0, 0.07),), LID_HEIGHT),
            *others,
            Item("decoy/body", ((0, 0, 0.034),)),
        ]

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        grasp = from_above((0, 0, -0.013))
        on = shifted(grasp, (0, 0, TOP + DROP + _SLACK))
        tight = se3.make(se3.euler(z=-TURN), (0, 0, TOP + _SLACK)) @ grasp
        lid, jar = "lid/body", "jar/body"
        return [
            Waypoint(lid, backed_off(grasp, 0.10), gripper_open=True),
            Waypoint(lid, grasp, gripper_open=False, allow_collisions=True, linear=True),
            Waypoint(lid, shifted(grasp, (0, 0, 0.18)), False, allow_collisions=True, linear=True),
            Waypoint(jar, shifted(on, (0, 0, 0.05)), gripper_open=False),
            Waypoint(jar, on, gripper_open=False, allow_collisions=True, linear=True),
            Waypoint(jar, tight, gripper_open=True, allow_collisions=True, linear=True),
        ]

    def success(self, world: World) -> bool:
        T_jar_lid = se3.invert(world.pose("jar/body")) @ world.pose("lid/body")
        clockwise = -np.arctan2(T_jar_lid[1, 0], T_jar_lid[0, 0]) % np.pi
        turned = _TIGHT < clockwise < np.pi - _TIGHT
        down = abs(T_jar_lid[2, 3] - TOP) < 0.0012 and T_jar_lid[2, 2] > 0.995
        return not world.held and bool(turned and down and np.hypot(*T_jar_lid[:2, 3]) < 0.003)
