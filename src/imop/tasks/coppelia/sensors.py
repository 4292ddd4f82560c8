"""Proximity sensors: whether a shape's surface passes through a volume, or a dummy's origin lies in it.

A solid that encloses the whole volume is not detected, as in the program: surfaces count, not insides.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.sim.world import World
from imop.tasks.coppelia.model import Dummy, Model, ProximitySensor, Shape
from imop.types import BoolArray, FloatArray

_SIDES = 24
"""Of the prisms that stand for round volumes."""


@dataclass(frozen=True, eq=False)
class Volume:
    """A convex volume: the hull of two polygons with as many corners (n, 3), in the sensor's frame."""

    near: FloatArray
    far: FloatArray

    @cached_property
    def corners(self) -> FloatArray:
        """(2 n, 3)."""
        return np.concatenate([self.near, self.far])

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Least and largest coordinates of the corners, (3,) each."""
        return self.corners.min(axis=0), self.corners.max(axis=0)

    @cached_property
    def edges(self) -> FloatArray:
        """(e, 3) directions of the edges, each once."""
        around = [np.roll(ring, -1, axis=0) - ring for ring in (self.near, self.far)]
        return _directions(np.concatenate([*around, self.far - self.near]))

    @cached_property
    def normals(self) -> FloatArray:
        """(f, 3) directions across the faces, each once."""
        along, up = np.roll(self.far, -1, axis=0) - self.far, self.far - self.near
        return _directions(np.concatenate([np.cross(along, up), [[0.0, 0.0, 1.0]]]))


def _directions(vectors: FloatArray) -> FloatArray:
    """Vectors at unit length, each direction or its opposite once."""
    length = np.linalg.norm(vectors, axis=1)
    units = vectors[length > 1e-12] / length[length > 1e-12, None]
    first = np.take_along_axis(units, np.argmax(np.abs(units) > 1e-6, axis=1)[:, None], axis=1)
    unique: FloatArray = np.unique(np.round(units * np.sign(first), 9), axis=0)
    return unique


@lru_cache(maxsize=64)  # resized models have sensors of their own in every scene
def volume(sensor: ProximitySensor) -> Volume:
    """What a sensor looks into."""
    if sensor.kind == "pyramid":
        ring = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=np.float64)
    else:
        angle = 2 * np.pi * np.arange(_SIDES) / _SIDES
        ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ends = [(sensor.near, sensor.offset), (sensor.far, sensor.offset + sensor.range)]
    rings = [np.column_stack([ring * size, np.full(len(ring), z)]) for size, z in ends]
    return Volume(*rings)


def intersects(volume: Volume, triangles: FloatArray) -> BoolArray:
    """(t,) whether each triangle (t, 3, 3), in the volume's frame, meets it: no plane separates the two."""
    low, high = volume.bounds
    meets: BoolArray = np.all((triangles.min(axis=1) <= high) & (triangles.max(axis=1) >= low), axis=1)
    near = np.flatnonzero(meets)
    if len(near) == 0:
        return meets
    t = triangles[near]
    sides = np.roll(t, -1, axis=1) - t
    flat = np.cross(sides[:, 0], sides[:, 1])[:, None]
    across = np.cross(sides[:, :, None], volume.edges).reshape(len(t), -1, 3)
    fixed = np.broadcast_to(volume.normals, (len(t), *volume.normals.shape))
    axes = np.concatenate([fixed, flat, across], axis=1)
    own, other = t @ axes.transpose(0, 2, 1), volume.corners @ axes.transpose(0, 2, 1)
    gap = np.maximum(own.min(axis=1) - other.max(axis=1), other.min(axis=1) - own.max(axis=1))
    meets[near] = np.all(gap <= 1e-12, axis=1)
    return meets


def detects(world: World, model: Model, sensor: str, name: str, prefix: str = "") -> bool:
    """Whether a sensor detects a shape's own surface, not what hangs on it, or a dummy's origin now.

    Raises:
        InvalidInput: if they are not a sensor, and a shape or dummy, of the model.
    """
    detector, target = model[sensor], model[name]
    if not isinstance(detector, ProximitySensor):
        raise InvalidInput("sensor", sensor, "the name of a proximity sensor")
    if not isinstance(target, Shape | Dummy):
        raise InvalidInput("name", f"{name} is neither", "the name of a shape or a dummy")
    T_sensor_target = se3.invert(world.pose(prefix + sensor)) @ world.pose(prefix + name)
    center, radius = target.ball if isinstance(target, Shape) else (np.zeros(3), 0.0)
    low, high = volume(detector).bounds
    p_center = se3.apply(T_sensor_target, center[None])[0]
    if np.any((p_center < low - radius) | (p_center > high + radius)):
        return False
    corners = target.corners if isinstance(target, Shape) else np.zeros((1, 3, 3))
    triangles = se3.apply(T_sensor_target, corners.reshape(-1, 3)).reshape(-1, 3, 3)
    if isinstance(target, Shape) and not (detector.front_faces and detector.back_faces):
        normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        towards = np.einsum("ti,ti->t", normal, triangles.mean(axis=1)) < 0
        triangles = triangles[towards if detector.front_faces else ~towards]
    return bool(np.any(intersects(volume(detector), triangles)))
