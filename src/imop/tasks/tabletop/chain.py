"""Several table tasks in one scene, done one after the other."""

# ruff: noqa: D102 (the methods are described in Task and TableTask)
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import mujoco
import numpy as np

from imop.sim.parts.shapes import add_to
from imop.sim.world import World
from imop.tasks.clutter import add_clutter
from imop.tasks.grasps import backed_off
from imop.tasks.layout import Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint
from imop.types import FloatArray

_RETREAT = 0.10
"""Metres that the hand goes back between two parts."""
_CLUTTER = 2
_MEMORY = 2**26
"""Bytes for contacts: there are many while a scene of so many things is drawn."""
_SHIFT = 3
"""Parts take their variations in turn, each so many later than the part before: their colours differ."""


class Chain(TableTask):
    """Its things are those of all parts, its steps those of the first part, of the second, and so on.

    Between two parts the hand retreats and opens. It is done when the aims of all parts are reached at
    once, so what a part did must not be undone later. The things of part k are called "k/..." in the scene.

    Attributes:
        parts: the tasks, in their order. A part may end with something in the hand, or with a step in the
            frame of what that step moves, only if it is the last.
    """

    parts: ClassVar[tuple[type[TableTask], ...]]

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        cls.variations = max(part.variations for part in cls.parts)
        cls.step_limit = sum(part.step_limit for part in cls.parts)
        cls.told_by_color = any(part.told_by_color for part in cls.parts)

    def __init__(self) -> None:
        self._parts = [part() for part in self.parts]

    def instructions(self, variation: int) -> tuple[str, ...]:
        words = [part.instructions(v) for part, v in self._variations(variation)]
        return tuple("; then ".join(texts) for texts in zip(*words, strict=False))

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        spec.memory = _MEMORY
        graspable: list[str] = []
        for k, (part, v) in enumerate(self._variations(variation)):
            things = mujoco.MjSpec()
            part.build(things, v, rng)
            add_to(spec, str(k), things)
            graspable += [_of(k, body) for body in part.graspable]
        self.graspable = tuple(graspable)

    def furnish(self, spec: Any, rng: np.random.Generator) -> None:
        add_clutter(spec, rng, most=_CLUTTER)

    def prepare(self, world: World) -> None:
        for part, alone in self._each(world):
            part.prepare(alone)

    def items(self) -> Sequence[Item]:
        items = [
            replace(item, body=_of(k, item.body))
            for k, part in enumerate(self._parts)
            for item in part.items()
        ]
        return sorted(items, key=lambda item: -sum(radius**2 for _, _, radius in item.footprint))

    def arrange(self, world: World, rng: np.random.Generator) -> None:
        for part, alone in self._each(world):
            part.arrange(alone, rng)

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        steps: list[Waypoint] = []
        for k, (part, alone) in enumerate(self._each(world)):
            mine = list(part.waypoints(alone))
            if k + 1 < len(self._parts):
                mine.append(_retreat(mine[-1]))
            steps += [replace(step, frame=_of(k, step.frame)) for step in mine]
        return steps

    def watch(self, world: World) -> None:
        for part, alone in self._each(world):
            part.watch(alone)

    def success(self, world: World) -> bool:
        return all(part.success(alone) for part, alone in self._each(world))

    def _variations(self, variation: int) -> list[tuple[TableTask, int]]:
        return [(part, (variation + _SHIFT * k) % part.variations) for k, part in enumerate(self._parts)]

    def _each(self, world: World) -> Iterator[tuple[TableTask, World]]:
        for k, part in enumerate(self._parts):
            yield part, _Alone(world, k)


class _Alone(World):
    """A view of a world in which the things of a part have the names that the part gave them."""

    def __init__(self, world: World, number: int):
        vars(self).update(vars(world))
        self._whole, self._number = world, number

    @property
    def held(self) -> tuple[str, ...]:
        prefix = _of(self._number, "")
        return tuple(b.removeprefix(prefix) for b in self._whole.held if b.startswith(prefix))

    def pose(self, body: str) -> FloatArray:
        return self._whole.pose(_of(self._number, body))

    def set_free_pose(self, body: str, T_world_body: FloatArray) -> None:
        self._whole.set_free_pose(_of(self._number, body), T_world_body)

    def joint(self, name: str) -> float:
        return self._whole.joint(_of(self._number, name))

    def set_joint(self, name: str, position: float) -> None:
        self._whole.set_joint(_of(self._number, name), position)


def _of(number: int, name: str) -> str:
    return f"{number}/{name}"


def _retreat(last: Waypoint) -> Waypoint:
    T = backed_off(last.T_frame_gripper, _RETREAT)
    return Waypoint(last.frame, T, gripper_open=True, allow_collisions=True, linear=True)
