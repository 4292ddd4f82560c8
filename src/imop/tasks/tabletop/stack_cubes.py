"""Stack cubes of one colour on a base plate."""

# ruff: noqa: D102 (the methods are described in Task)
from collections.abc import Sequence
from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.parts.shapes import add_to
from imop.sim.parts.solids import block
from imop.sim.world import World
from imop.tasks.colors import NAMED
from imop.tasks.grasps import backed_off, from_above, shifted
from imop.tasks.layout import Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint

COLORS = tuple(NAMED)
COUNTS = (1, 2)
_DISTRACTORS = 3
_ROOM = 0.065
"""Around a cube, for the fingers."""
_PLATE = 0.015
_DEPTH = 0.018
"""How far the finger ends are below the upper face of a grasped cube."""


def aim(variation: int) -> tuple[str, int]:
    """Colour and number of the cubes to stack."""
    return COLORS[variation // len(COUNTS)], COUNTS[variation % len(COUNTS)]


class StackCubes(TableTask):
    """One or two cubes of the variation's colour go onto the plate; cubes of other colours distract."""

    name = "tabletop/stack_cubes"
    told_by_color = True
    variations = len(COLORS) * len(COUNTS)

    def instructions(self, variation: int) -> tuple[str, ...]:
        color, count = aim(variation)
        cubes = f"{count} {color} cube{'s' if count > 1 else ''}"
        return (f"stack {cubes} on the plate", f"build a tower of {cubes} on the plate")

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        color, count = aim(variation)
        self.size = rng.uniform(0.04, 0.05)
        self.targets = tuple(f"target{i}/body" for i in range(count))
        self.graspable = self.targets + tuple(f"other{i}/body" for i in range(_DISTRACTORS))
        width, grey = rng.uniform(0.09, 0.11), rng.uniform(0.2, 0.4)
        add_to(spec, "plate", block((width, width, _PLATE), (grey, grey, grey)))
        cube = (self.size, self.size, self.size)
        for i in range(count):
            add_to(spec, f"target{i}", block(cube, NAMED[color]))
        others = rng.permutation([c for c in COLORS if c != color])
        for i in range(_DISTRACTORS):
            add_to(spec, f"other{i}", block(cube, NAMED[str(others[i])]))

    def items(self) -> Sequence[Item]:
        plate = Item("plate/body", ((0, 0, 0.09),), _PLATE)
        return [plate, *(Item(cube, ((0, 0, _ROOM),), self.size) for cube in self.graspable)]

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        grasp = from_above((0, 0, -_DEPTH))
        steps = []
        for i, cube in enumerate(self.targets):
            place = shifted(grasp, (0, 0, (i + 1) * self.size + 0.003))
            above = shifted(place, (0, 0, 0.08))
            steps += [
                Waypoint(cube, backed_off(grasp, 0.10), gripper_open=True),
                Waypoint(cube, grasp, gripper_open=False, allow_collisions=True, linear=True),
                Waypoint(cube, shifted(grasp, (0, 0, 0.15)), False, allow_collisions=True, linear=True),
                Waypoint("plate/body", above, gripper_open=False),
                Waypoint("plate/body", place, gripper_open=True, allow_collisions=True, linear=True),
            ]
            if i + 1 < len(self.targets):
                steps.append(Waypoint("plate/body", above, True, allow_collisions=True, linear=True))
        return steps

    def success(self, world: World) -> bool:
        if world.held:
            return False
        T_plate_world = se3.invert(world.pose("plate/body"))
        p = np.array([(T_plate_world @ world.pose(cube))[:3, 3] for cube in self.targets])
        heights = (np.arange(len(p)) + 1) * self.size
        level = np.abs(np.sort(p[:, 2]) - heights).max() < 0.005
        return bool(level and np.linalg.norm(p[:, :2], axis=1).max() < 0.025)
