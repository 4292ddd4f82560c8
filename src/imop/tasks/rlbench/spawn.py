"""RLBench's random placement: a model's box is turned and then shifted within a rectangle."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from imop.geometry import se3
from imop.tasks.coppelia.boxes import Box, corners, model_box, own_box
from imop.tasks.layout import ANY_YAW, NoRoom
from imop.tasks.rlbench.scene import Scene
from imop.types import FloatArray, IntArray

_TRIES = 100


@dataclass(frozen=True, eq=False)
class Area:
    """A flat rectangle; things are placed on it at the height over it that they have.

    Attributes:
        T_world_area: (4, 4).
        lower: (2,) corner in its frame, metres.
        upper: (2,) opposite corner.
    """

    T_world_area: FloatArray
    lower: FloatArray
    upper: FloatArray

    @property
    def size(self) -> float:
        """Square metres."""
        return float(np.prod(self.upper - self.lower))


WORKSPACE = Area(se3.make(p=(0.25, 0.0, 0.752)), np.array([-0.325, -0.455]), np.array([0.325, 0.455]))
"""Where RLBench puts tasks."""


def area(scene: Scene, name: str) -> Area:
    """The rectangle that a plane of the model spans, where it is now."""
    box = own_box(scene.model[name])
    assert box is not None
    return Area(scene.pose(name), box[0][:2], box[1][:2])


def draw(
    rng: np.random.Generator, box: Box, lower: FloatArray, upper: FloatArray, yaw: tuple[float, float]
) -> tuple[float, float, float] | None:
    """A random place (x, y) and yaw in a rectangle; None if the box does not fit at the drawn yaw.

    A box whose far side is farther from its origin than the rectangle reaches never fits, as in RLBench,
    even if it would elsewhere.

    Args:
        rng: source of randomness.
        box: of what is placed, in its own frame.
        lower: (2,) corner of the rectangle.
        upper: (2,) opposite corner.
        yaw: its bounds, radians.
    """
    angle = rng.uniform(*yaw)
    turned = corners(box)[:, :2] @ se3.euler(z=angle)[:2, :2]  # by minus the angle, as RLBench has it
    low, high = turned.min(axis=0), turned.max(axis=0)
    if np.any(low <= lower) or np.any(high >= upper):
        return None
    x, y = rng.uniform(lower + np.abs(low), upper - np.abs(high))
    return float(x), float(y), float(angle)


def place_in(
    scene: Scene, rng: np.random.Generator, area: Area, name: str, yaw: tuple[float, float]
) -> FloatArray | None:
    """A random T_world_object (4, 4) of an object in an area, None if the draw fails."""
    drawn = draw(rng, model_box(scene.world, scene.model, name), area.lower, area.upper, yaw)
    if drawn is None:
        return None
    x, y, angle = drawn
    T_area_object = se3.invert(area.T_world_area) @ scene.pose(name)
    p = (area.T_world_area @ (x, y, T_area_object[2, 3], 1.0))[:3]
    return se3.make(scene.pose(name)[:3, :3] @ se3.euler(z=angle), p)


class Boundary:
    """Rectangles in which several things are placed without touching each other.

    Args:
        scene: the scene.
        rng: source of randomness.
        areas: one is drawn for each thing, the larger the likelier.
    """

    def __init__(self, scene: Scene, rng: np.random.Generator, areas: Sequence[Area]):
        self._scene, self._rng, self._areas = scene, rng, list(areas)
        self._placed: list[str] = []

    def sample(
        self,
        name: str,
        yaw: tuple[float, float] = ANY_YAW,
        min_distance: float = 0.01,
        touching: bool = False,
    ) -> None:
        """Put an object at a random place.

        Args:
            name: of the object.
            yaw: bounds of its turn, radians.
            min_distance: of its origin from those of others placed here.
            touching: whether it may touch others.

        Raises:
            NoRoom: if no place was found.
        """
        sizes = np.array([a.size for a in self._areas])
        untouched = self._scene.world.save_state()
        for _ in range(2 * _TRIES):
            area = self._areas[int(self._rng.choice(len(self._areas), p=sizes / sizes.sum()))]
            T = place_in(self._scene, self._rng, area, name, yaw)
            if T is None or self._too_near(T, min_distance):
                continue
            self._scene.place(name, T)
            if touching or not any(touch(self._scene, name, other) for other in self._placed):
                self._placed.append(name)
                return
            self._scene.world.restore_state(untouched)
        raise NoRoom(f"{name}: no free place in its boundary")

    def _too_near(self, T: FloatArray, min_distance: float) -> bool:
        origins = [self._scene.pose(other)[:3, 3] for other in self._placed]
        return any(float(np.linalg.norm(T[:3, 3] - p)) < min_distance for p in origins)


def touch(scene: Scene, first: str, second: str) -> bool:
    """Whether anything solid of one object's subtree touches the other's."""
    m, d = scene.world.model, scene.world.data
    pairs = itertools.product(_solids(scene, first), _solids(scene, second))
    return any(
        float(np.linalg.norm(d.geom_xpos[a] - d.geom_xpos[b])) < m.geom_rbound[a] + m.geom_rbound[b]
        and mujoco.mj_geomDistance(m, d, int(a), int(b), 0.001, None) <= 0
        for a, b in pairs
    )


def _solids(scene: Scene, name: str) -> IntArray:
    model, m = scene.model, scene.world.model
    bodies = [m.body(model.objects[i].name).id for i in model.subtree(model.index[name])]
    solid = np.isin(m.geom_bodyid, bodies) & (m.geom_contype != 0)
    return np.flatnonzero(solid).astype(np.int32)
