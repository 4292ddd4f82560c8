"""Put the toys into the bowl."""

# ruff: noqa: D102 (the methods are described in Task)
from collections.abc import Sequence
from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.parts.bowl import bowl
from imop.sim.parts.shapes import add_to
from imop.sim.parts.toys import TOYS, toy
from imop.sim.world import World
from imop.tasks.colors import random_color
from imop.tasks.grasps import backed_off, from_above, shifted
from imop.tasks.layout import Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint

_COUNT = 2
_ROOM = 0.065
"""Around a toy, for the fingers."""
_DROP, _RISE = 0.06, 0.03
"""How high above the rim a toy is let go, and how high one may lie on the other, metres."""


class ToysInBowl(TableTask):
    """Pick one toy after the other from above and drop it into the bowl; nothing else lies about."""

    name = "tabletop/toys_in_bowl"
    graspable = tuple(f"toy{i}/body" for i in range(_COUNT))

    def instructions(self, variation: int) -> tuple[str, ...]:
        return ("put the toys in the bowl", "tidy the toys away into the bowl")

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        self.radius, self.depth = rng.uniform(0.09, 0.115), rng.uniform(0.05, 0.075)
        add_to(spec, "bowl", bowl(self.radius, self.depth, random_color(rng)))
        self.kinds = [TOYS[int(k)] for k in rng.permutation(len(TOYS))[:_COUNT]]
        self.toy_sizes = rng.uniform(0.034, 0.046, _COUNT)
        for i, (kind, size) in enumerate(zip(self.kinds, self.toy_sizes, strict=True)):
            add_to(spec, f"toy{i}", toy(kind, float(size), random_color(rng), random_color(rng)))

    def furnish(self, spec: Any, rng: np.random.Generator) -> None:
        """Nothing: what lies on the table is a toy."""

    def items(self) -> Sequence[Item]:
        toys = [
            Item(body, ((0, 0, _ROOM),), kind.grasp * size)
            for body, kind, size in zip(self.graspable, self.kinds, self.toy_sizes, strict=True)
        ]
        return [Item("bowl/body", ((0, 0, self.radius + 0.01),), self.depth), *toys]

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        grasp, steps = from_above(), []
        for side, body in zip((-1, 1), self.graspable, strict=True):
            drop = from_above((0.0, side * 0.3 * self.radius, _DROP))
            steps += [
                Waypoint(body, backed_off(grasp, 0.10), gripper_open=True),
                Waypoint(body, grasp, gripper_open=False, allow_collisions=True, linear=True),
                Waypoint(body, shifted(grasp, (0, 0, 0.18)), False, allow_collisions=True, linear=True),
                Waypoint("bowl/body", drop, gripper_open=True),
            ]
        return steps

    def success(self, world: World) -> bool:
        T_bowl_world = se3.invert(world.pose("bowl/body"))
        p = np.array([(T_bowl_world @ world.pose(body))[:3, 3] for body in self.graspable])
        inside = (np.linalg.norm(p[:, :2], axis=1) < self.radius) & (p[:, 2] < _RISE)
        return not world.held and bool(np.all(inside))
