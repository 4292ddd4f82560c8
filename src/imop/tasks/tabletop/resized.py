"""A table task whose things are all larger or smaller by one factor.

The task goes on in the sizes that it drew: it is shown the world as if nothing had been resized, and what it
says of places is scaled. The table, the arm and the clutter keep their sizes.
"""

# ruff: noqa: D102 (the methods are described in Task and TableTask)
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from imop.geometry import se3
from imop.sim.resize import resize
from imop.sim.world import TABLE_HEIGHT, World
from imop.tasks.layout import Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint
from imop.types import FloatArray

_CENTRE = np.array([0.0, 0.0, TABLE_HEIGHT])
"""What lies on the table does so in both sizes."""


class Resized(TableTask):
    """A task with its things at `scale` times their size."""

    def __init__(self, task: TableTask, scale: float):
        self._task, self._scale = task, scale
        self.name, self.variations = task.name, task.variations
        self.step_limit, self.insist = task.step_limit, task.insist

    def instructions(self, variation: int) -> tuple[str, ...]:
        return self._task.instructions(variation)

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        before = {body.name for body in spec.worldbody.bodies}
        self._task.build(spec, variation, rng)
        self.graspable = self._task.graspable
        resize(spec, [body for body in spec.worldbody.bodies if body.name not in before], self._scale)

    def furnish(self, spec: Any, rng: np.random.Generator) -> None:
        self._task.furnish(spec, rng)

    def prepare(self, world: World) -> None:
        self._task.prepare(world)

    def items(self) -> Sequence[Item]:
        s = self._scale
        return [
            replace(
                item,
                footprint=tuple((s * x, s * y, s * radius) for x, y, radius in item.footprint),
                height=s * item.height,
            )
            for item in self._task.items()
        ]

    def arrange(self, world: World, rng: np.random.Generator) -> None:
        self._task.arrange(_AsDrawn(world, self._scale), rng)

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        return [
            replace(w, T_frame_gripper=_at(w.T_frame_gripper, self._scale * w.T_frame_gripper[:3, 3]))
            for w in self._task.waypoints(_AsDrawn(world, self._scale))
        ]

    def watch(self, world: World) -> None:
        self._task.watch(_AsDrawn(world, self._scale))

    def success(self, world: World) -> bool:
        return self._task.success(_AsDrawn(world, self._scale))


class _AsDrawn(World):
    """A view of a world with resized things in which they have the sizes that their task drew."""

    def __init__(self, world: World, scale: float):
        vars(self).update(vars(world))
        self._scale = scale

    def pose(self, body: str) -> FloatArray:
        T = super().pose(body)
        return _at(T, _CENTRE + (T[:3, 3] - _CENTRE) / self._scale)

    def set_free_pose(self, body: str, T_world_body: FloatArray) -> None:
        p = _CENTRE + self._scale * (T_world_body[:3, 3] - _CENTRE)
        super().set_free_pose(body, _at(T_world_body, p))

    def joint(self, name: str) -> float:
        return super().joint(name) / self._unit(name)

    def set_joint(self, name: str, position: float) -> None:
        super().set_joint(name, position * self._unit(name))

    def _unit(self, joint: str) -> float:
        slides = self.model.joint(joint).type[0] == mujoco.mjtJoint.mjJNT_SLIDE
        return self._scale if slides else 1.0


def _at(T: FloatArray, p: FloatArray) -> FloatArray:
    return se3.make(T[:3, :3], p)
