"""Pull a rope straight."""

# ruff: noqa: D102 (the methods are described in Task)
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from imop.geometry import se3
from imop.sim.parts.rope import RopeShape, bend, outline, rope
from imop.sim.parts.shapes import add_to, part, rgba
from imop.sim.world import TABLE_HEIGHT, World
from imop.tasks.colors import NAMED, random_color
from imop.tasks.grasps import backed_off, from_above, shifted
from imop.tasks.layout import Area, Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint
from imop.types import FloatArray

_PLATE = 0.035
"""Radius of the targets."""
_SLACK = 0.96
"""Distance of the targets over the rope's length."""
_STRAIGHT = 0.87
"""Distance of the ends, over the rope's length, from which the rope counts as straight."""
_LIFT = 0.07


def _target(color: tuple[float, float, float]) -> Any:
    """A flat round mark on the table, without contact; frame: its middle."""
    spec, body = part(fixed=True)
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[_PLATE, 0.0005, 0],
        rgba=rgba(color),
        contype=0,
        conaffinity=0,
    )
    return spec


class StraightenRope(TableTask):
    """Take each end of the rope and lay it onto the mark of its colour; then the rope lies straight."""

    name = "tabletop/straighten_rope"
    told_by_color = True
    sizes = None
    sizes = None

    def instructions(self, variation: int) -> tuple[str, ...]:
        return (
            "straighten the rope",
            "pull both ends of the rope onto the marks of their colours",
            "lay the rope out in a straight line",
        )

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        self.rope = RopeShape(int(rng.integers(13, 16)), rng.uniform(0.022, 0.025), rng.uniform(0.007, 0.009))
        self.ends = tuple(f"rope/{end}" for end in self.rope.ends)
        self.marks = ("mark0/body", "mark1/body")
        self.graspable = self.ends
        colors = [NAMED[str(c)] for c in rng.choice(["red", "lime", "blue", "magenta", "cyan"], 2, False)]
        add_to(spec, "rope", rope(self.rope, random_color(rng, 0.5), (colors[0], colors[1])))
        for i, color in enumerate(colors):
            add_to(spec, f"mark{i}", _target(color))

    def items(self) -> Sequence[Item]:
        # Around mark0; mark1 lies on its +y side and the rope on its +x side, see `arrange`.
        y = _SLACK * self.rope.length
        rows = tuple((x, float(at), 0.07) for x in (0.0, 0.1) for at in np.linspace(0, y, 4))
        return [Item("mark0/body", rows, 0.0006, Area((0.0, 0.46), (-0.36, 0.36)))]

    def arrange(self, world: World, rng: np.random.Generator) -> None:
        T = world.pose("mark0/body")
        distance = _SLACK * self.rope.length
        world.set_free_pose("mark1/body", T @ se3.make(p=(0, distance, 0)))
        angles = self._wave(rng)
        middles = outline(self.rope, angles)
        across = middles[-1] / np.linalg.norm(middles[-1])
        turn = np.array([[across[1], -across[0]], [across[0], across[1]]])
        laid = middles @ turn.T
        offset = np.array([0.1, distance / 2]) - (laid.min(axis=0) + laid.max(axis=0)) / 2
        yaw = np.pi / 2 - np.arctan2(across[1], across[0])
        start = se3.make(se3.euler(z=yaw), (*offset, 0))
        pose = T @ start
        pose[2, 3] = TABLE_HEIGHT + self.rope.radius
        world.set_free_pose("rope/body", pose)
        bend(world, "rope", self.rope, angles)

    def _wave(self, rng: np.random.Generator) -> FloatArray:
        """Angles between the links: an S, of random width and handedness."""
        s = np.linspace(0, 1, self.rope.links - 1)
        swing = rng.uniform(0.8, 1.1) * rng.choice([-1.0, 1.0])
        heading = swing * np.cos(2 * np.pi * s + rng.uniform(-0.3, 0.3))
        angles: FloatArray = np.diff(heading, prepend=heading[0])
        return angles

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        grasp = from_above((0, 0, -self.rope.radius + 0.004))
        place = from_above((0, 0, 0.005), np.pi / 2)
        steps = []
        for end, mark in zip(self.ends, self.marks, strict=True):
            steps += [
                Waypoint(end, backed_off(grasp, 0.08), gripper_open=True),
                Waypoint(end, grasp, gripper_open=False, allow_collisions=True, linear=True),
                Waypoint(end, shifted(grasp, (0, 0, _LIFT)), False, allow_collisions=True, linear=True),
                Waypoint(mark, place, gripper_open=True, allow_collisions=True, linear=True),
                Waypoint(mark, shifted(place, (0, 0, 0.08)), True, allow_collisions=True, linear=True),
            ]
        return steps[:-1]

    def success(self, world: World) -> bool:
        pairs = [(world.pose(end), world.pose(mark)) for end, mark in zip(self.ends, self.marks, strict=True)]
        on = all(np.linalg.norm((a - b)[:2, 3]) < _PLATE for a, b in pairs)
        flat = all(a[2, 3] < TABLE_HEIGHT + 2 * self.rope.radius for a, _ in pairs)
        apart = np.linalg.norm(pairs[0][0][:3, 3] - pairs[1][0][:3, 3])
        return not world.held and bool(on and flat and apart > _STRAIGHT * self.rope.length)
