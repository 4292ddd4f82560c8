"""Pour a cup into a bowl."""

# ruff: noqa: D102 (the methods are described in Task)
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from imop.geometry import se3
from imop.sim.parts.bowl import bowl
from imop.sim.parts.cup import WALL, CupShape, cup
from imop.sim.parts.shapes import add_to, part, rgba
from imop.sim.world import World
from imop.tasks.clutter import add_clutter
from imop.tasks.colors import random_color
from imop.tasks.grasps import backed_off, from_side, shifted
from imop.tasks.layout import Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint
from imop.types import FloatArray

_BALLS = tuple(f"ball{i}/body" for i in range(5))
_BALL = 0.0075
"""Radius of a ball, metres."""
_SPILT = 1
"""So many balls may miss the bowl."""
_PITCH, _ROLL = np.radians(20.0), np.radians(130.0)
_ABOVE = 0.035
"""How far the lowest point of the tilted rim is above the bowl's."""
_AHEAD = (-0.7, 0.7)
"""Turn of cup and bowl in which the hand points away from the arm, radians."""


class PourCup(TableTask):
    """Take the cup from the side opposite its handle, carry it level over the bowl and turn the wrist."""

    name = "tabletop/pour_cup"
    graspable = ("cup/body",)
    sizes = (0.85, 1.1)

    def instructions(self, variation: int) -> tuple[str, ...]:
        return ("pour the cup into the bowl", "pick up the cup and pour what is in it into the bowl")

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        self.shape = CupShape(
            radius=rng.uniform(0.028, 0.034),
            height=rng.uniform(0.075, 0.1),
            taper=rng.uniform(0.85, 1.0),
            reach=rng.uniform(0.026, 0.034),
        )
        self.radius, self.depth = rng.uniform(0.085, 0.11), rng.uniform(0.05, 0.075)
        add_to(spec, "cup", cup(self.shape, random_color(rng)))
        add_to(spec, "bowl", bowl(self.radius, self.depth, random_color(rng)))
        color = random_color(rng)
        for name in _BALLS:
            add_to(spec, name.split("/")[0], _ball(color))

    def furnish(self, spec: Any, rng: np.random.Generator) -> None:
        add_clutter(spec, rng, most=3, shapes=("box", "ball", "cone"))

    def prepare(self, world: World) -> None:
        # What lies in the cup goes with it.
        world.unavoided = frozenset(int(world.model.body(ball).id) for ball in _BALLS)

    def items(self) -> Sequence[Item]:
        r, handle = self.shape.radius, (self.shape.radius + self.shape.reach / 2, 0.0, 0.025)
        hand = tuple((x, 0.0, 0.07) for x in (-0.06, -0.14))
        return [
            Item("bowl/body", ((0, 0, self.radius + 0.01),), self.depth, yaw=_AHEAD),
            Item("cup/body", ((0, 0, r + 0.02), handle, *hand), self.shape.height, yaw=_AHEAD),
        ]

    def arrange(self, world: World, rng: np.random.Generator) -> None:
        reach = self.shape.taper * self.shape.radius - WALL - _BALL - 0.001
        angle = 2 * np.pi * np.arange(len(_BALLS)) / len(_BALLS)
        low = WALL + _BALL - self.shape.height
        for i, ball in enumerate(_BALLS):
            p = (reach * np.cos(angle[i]), reach * np.sin(angle[i]), low)
            world.set_free_pose(ball, world.pose("cup/body") @ se3.make(p=p))

    @property
    def _grasp(self) -> FloatArray:
        """T_cup_gripper (4, 4)."""
        return from_side((0.0, 0.0, -0.5 * self.shape.height), _PITCH)

    def _poured(self) -> FloatArray:
        """T_bowl_gripper (4, 4) with the lowest point of the tilted rim over the bowl's middle."""
        rolled = self._grasp @ se3.make(se3.euler(z=_ROLL))
        T_level_tilted = rolled @ se3.invert(self._grasp)
        up, down = T_level_tilted[:3, 2], np.array([0.0, 0.0, -1.0])
        outwards = down - (down @ up) * up
        lip = T_level_tilted[:3, 3] + self.shape.radius * outwards / np.linalg.norm(outwards)
        return se3.make(p=(0.0, 0.0, _ABOVE) - lip) @ rolled

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        poured = self._poured()
        level = poured @ se3.make(se3.euler(z=-_ROLL))
        return [
            Waypoint("cup/body", backed_off(self._grasp, 0.08), gripper_open=True),
            Waypoint("cup/body", self._grasp, gripper_open=False, allow_collisions=True, linear=True),
            Waypoint("cup/body", shifted(self._grasp, (0, 0, 0.16)), False, True, linear=True),
            # On a way that is not straight the cup would lean, and be empty on arrival.
            Waypoint("bowl/body", level, gripper_open=False, linear=True),
            Waypoint("bowl/body", poured, gripper_open=False, allow_collisions=True, linear=True),
        ]

    def success(self, world: World) -> bool:
        T_bowl_world = se3.invert(world.pose("bowl/body"))
        p = np.array([(T_bowl_world @ world.pose(ball))[:3, 3] for ball in _BALLS])
        inside = (np.linalg.norm(p[:, :2], axis=1) < self.radius) & (p[:, 2] < 0) & (p[:, 2] > -self.depth)
        return int(inside.sum()) >= len(_BALLS) - _SPILT


def _ball(color: tuple[float, float, float]) -> Any:
    """A small ball; frame: its centre."""
    spec, body = part()
    spec.joint("free").damping = [1e-7, 0, 0]
    sphere = mujoco.mjtGeom.mjGEOM_SPHERE
    body.add_geom(type=sphere, size=[_BALL, 0, 0], rgba=rgba(color), density=300.0)
    return spec
