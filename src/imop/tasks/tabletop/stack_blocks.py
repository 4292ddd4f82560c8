"""Build a tower of three blocks."""

# ruff: noqa: D102 (the methods are described in Task)
from collections.abc import Sequence
from typing import Any

import numpy as np

from imop.sim.parts.shapes import add_to
from imop.sim.parts.solids import block
from imop.sim.world import World
from imop.tasks.clutter import add_clutter
from imop.tasks.colors import NAMED
from imop.tasks.grasps import backed_off, from_above, shifted
from imop.tasks.layout import Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint

_LOWEST, *_UPPER = BLOCKS = ("large/body", "middle/body", "small/body")
_ROOM = 0.07
_DEPTH = 0.016
"""How far the finger ends are below the upper face of a grasped block."""
_OFF, _LEVEL = 0.022, 0.006
"""How far a block may be off the one below it, sideways and in height."""


class StackBlocks(TableTask):
    """The middle block goes onto the large one, and the small one onto that; either may be the upper one.

    Blocks are cuboids of other proportions and colours in every instance; clutter has round shapes.
    """

    name = "tabletop/stack_blocks"
    graspable = tuple(_UPPER)

    def instructions(self, variation: int) -> tuple[str, ...]:
        return ("stack the blocks", "build a tower of the three blocks, the largest one below")

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        widths = rng.uniform(0.062, 0.074), rng.uniform(0.047, 0.055), rng.uniform(0.034, 0.042)
        colors = rng.permutation(list(NAMED))
        self.heights = rng.uniform(0.034, 0.046, len(BLOCKS))
        self.widths = widths
        for body, width, height, color in zip(BLOCKS, widths, self.heights, colors, strict=False):
            size = (width * rng.uniform(1.0, 1.3), width, float(height))
            add_to(spec, body.split("/")[0], block(size, NAMED[str(color)]))

    def furnish(self, spec: Any, rng: np.random.Generator) -> None:
        add_clutter(spec, rng, most=3, shapes=("can", "ball", "cone"))

    def items(self) -> Sequence[Item]:
        return [Item(b, ((0, 0, _ROOM),), float(h)) for b, h in zip(BLOCKS, self.heights, strict=True)]

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        grasp = from_above((0, 0, -_DEPTH))
        steps = []
        for below, body, height in zip(BLOCKS, _UPPER, self.heights[1:], strict=False):
            place = shifted(grasp, (0, 0, float(height) + 0.003))
            above = shifted(place, (0, 0, 0.08))
            steps += [
                Waypoint(body, backed_off(grasp, 0.10), gripper_open=True),
                Waypoint(body, grasp, gripper_open=False, allow_collisions=True, linear=True),
                Waypoint(body, shifted(grasp, (0, 0, 0.16)), False, allow_collisions=True, linear=True),
                Waypoint(below, above, gripper_open=False),
                Waypoint(below, place, gripper_open=True, allow_collisions=True, linear=True),
                Waypoint(below, above, gripper_open=True, allow_collisions=True, linear=True),
            ]
        return steps[:-1]

    def success(self, world: World) -> bool:
        if world.held:
            return False
        p = np.array([world.pose(body)[:3, 3] for body in BLOCKS])
        order = np.argsort(p[:, 2])
        rises = np.diff(p[order, 2]) - self.heights[order[1:]]
        off = np.linalg.norm(np.diff(p[order, :2], axis=0), axis=1)
        return bool(order[0] == 0 and np.abs(rises).max() < _LEVEL and off.max() < _OFF)
