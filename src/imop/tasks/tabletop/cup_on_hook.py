"""Hang the cup of a colour on a hook."""

# ruff: noqa: D102 (the methods are described in Task)
from collections.abc import Sequence
from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.parts.cup import HANG, ROD, WALL, CupShape, along_rod, cup, hook_stand
from imop.sim.parts.shapes import add_to
from imop.sim.parts.solids import trinket
from imop.sim.world import World
from imop.tasks.colors import NAMED, random_color
from imop.tasks.grasps import backed_off, from_above, shifted
from imop.tasks.layout import Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint
from imop.types import FloatArray

COLORS = tuple(NAMED)
_TILT = np.radians(35.0)
_SLACK = 0.004
_OUT = 0.085
"""How far outwards on the rod's line the cup waits before the handle goes over it."""


class CupOnHook(TableTask):
    """Take the cup by the rim opposite its handle, and bring the handle over the rod from its end."""

    name = "tabletop/cup_on_hook"
    told_by_color = True
    variations = len(COLORS)
    graspable = ("cup/body", "other_cup/body")

    def instructions(self, variation: int) -> tuple[str, ...]:
        color = COLORS[variation]
        return (
            f"hang the {color} cup on the hook",
            f"pick up the {color} cup and hang it by its handle on the stand",
        )

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        self.shape = CupShape(
            radius=rng.uniform(0.036, 0.044),
            height=rng.uniform(0.075, 0.095),
            taper=rng.uniform(0.75, 1.0),
            reach=rng.uniform(0.028, 0.036),
        )
        color = COLORS[variation]
        other = str(rng.choice([c for c in COLORS if c != color]))
        height = rng.uniform(0.18, 0.24)
        add_to(spec, "stand", hook_stand(height, random_color(rng, 0.1, 0.5), random_color(rng)))
        add_to(spec, "cup", cup(self.shape, NAMED[color]))
        add_to(spec, "other_cup", cup(self.shape, NAMED[other]))
        add_to(spec, "decoy", trinket("can", 0.03, rng.uniform(0.05, 0.08), NAMED[color]))

    def items(self) -> Sequence[Item]:
        r, h = self.shape.radius, self.shape.height
        handle = (r + self.shape.reach / 2, 0.0, 0.025)
        return [
            Item("stand/body", ((0, 0, 0.08), (0.07, 0, 0.06))),
            Item("cup/body", ((0, 0, r + 0.01), (-r, 0, 0.055), handle), h),
            Item("other_cup/body", ((0, 0, r + 0.005), handle), h),
            Item("decoy/body", ((0, 0, 0.03),)),
        ]

    @property
    def _T_hook_cup(self) -> FloatArray:
        """Where the cup is let go: the rod in the upper outer corner of the tilted handle."""
        _, x, _, z = self.shape.loop
        corner = np.array([x - ROD - _SLACK, 0, z - ROD - _SLACK])
        R = se3.euler(z=-np.pi / 2) @ se3.euler(y=-_TILT)
        return se3.make(R, -R @ corner)

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        grasp = from_above((WALL / 2 - self.shape.radius, 0, -0.016), yaw=np.pi / 2)
        hung = self._T_hook_cup @ grasp
        cup, hook = "cup/body", "stand/hook"
        return [
            Waypoint(cup, backed_off(grasp, 0.10), gripper_open=True),
            Waypoint(cup, grasp, gripper_open=False, allow_collisions=True, linear=True),
            Waypoint(cup, shifted(grasp, (0, 0, 0.15)), False, allow_collisions=True, linear=True),
            Waypoint(hook, se3.make(p=along_rod(_OUT)) @ hung, gripper_open=False),
            Waypoint(hook, hung, gripper_open=True, allow_collisions=True, linear=True),
        ]

    def success(self, world: World) -> bool:
        T_cup_hook = se3.invert(world.pose("cup/body")) @ world.pose("stand/hook")
        inner, outer = se3.apply(T_cup_hook, np.stack([along_rod(-HANG), along_rod(HANG)]))
        if inner[1] * outer[1] >= 0:
            return False
        x, _, z = inner + (outer - inner) * inner[1] / (inner[1] - outer[1])
        x_low, x_high, z_low, z_high = self.shape.loop
        return not world.held and bool(x_low < x < x_high and z_low < z < z_high)
