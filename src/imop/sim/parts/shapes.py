"""What all parts are made of: a part with its body, boxes, cylinders and convex meshes."""

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from imop.types import FloatArray

Color = Sequence[float]
"""Red, green, blue, 0 .. 1."""

Point = Sequence[float] | FloatArray
"""x, y, z in metres."""

WOOD, PLASTIC, METAL, PAPER = 500.0, 350.0, 1200.0, 80.0
"""Densities in kg/m3, of solids that stand for partly hollow things."""


def part(fixed: bool = False) -> tuple[Any, Any]:
    """An empty part and its body, which moves freely unless it is `fixed`."""
    spec = mujoco.MjSpec()
    body = spec.worldbody.add_body(name="body")
    if not fixed:
        body.add_freejoint(name="free")
    return spec, body


def add_to(scene: Any, name: str, part: Any) -> None:
    """Attach `part` to the scene's world; its bodies are called `name`/..."""
    scene.attach(part, prefix=f"{name}/", frame=scene.worldbody.add_frame())


def rgba(color: Color) -> list[float]:
    """Opaque `color`."""
    return [*(float(c) for c in color), 1.0]


def box(body: Any, lower: Sequence[float], upper: Sequence[float], color: Color, density: float) -> None:
    """Add the axis-aligned box between two corners, metres in the body's frame."""
    low, high = np.asarray(lower, dtype=float), np.asarray(upper, dtype=float)
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=(low + high) / 2,
        size=(high - low) / 2,
        rgba=rgba(color),
        density=density,
    )


def cylinder(
    body: Any, radius: float, bottom: float, top: float, color: Color, density: float, **options: Any
) -> None:
    """Add an upright cylinder about the body's z axis."""
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        pos=[0, 0, (bottom + top) / 2],
        size=[radius, (top - bottom) / 2, 0],
        rgba=rgba(color),
        density=density,
        **options,
    )


def capsule(body: Any, start: Point, end: Point, radius: float, color: Color, density: float) -> None:
    """Add a rod with round ends between two points."""
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        fromto=[*start, *end],
        size=[radius, 0, 0],
        rgba=rgba(color),
        density=density,
    )


def hull_mesh(spec: Any, name: str, vertices: FloatArray) -> None:
    """Add the convex hull of `vertices` (N, 3) to the part's assets."""
    hull = ConvexHull(vertices)
    faces = hull.simplices.copy()
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    inward = np.einsum("fi,fi->f", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    faces[inward] = faces[inward][:, ::-1]
    spec.add_mesh(name=name, uservert=vertices.ravel(), userface=faces.astype(np.int32).ravel())


def mesh(body: Any, name: str, color: Color, density: float, yaw: float = 0.0) -> None:
    """Add a mesh of the part's assets, turned about the body's z axis by `yaw`."""
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=name,
        quat=Rotation.from_euler("z", yaw).as_quat(scalar_first=True),
        rgba=rgba(color),
        density=density,
    )
