"""A crumpled sheet of paper."""

from typing import Any

import mujoco
import numpy as np
from scipy.spatial import ConvexHull

from imop.sim.parts.shapes import PAPER, Color, part, rgba
from imop.types import FloatArray

_FOOT = 0.65
"""Height of the lump's centre above its flat underside, as a fraction of its radius."""


def _sphere(count: int) -> FloatArray:
    """`count` points spread evenly over the unit sphere (golden spiral), (count, 3)."""
    k = np.arange(count) + 0.5
    z = 1 - 2 * k / count
    phi = np.pi * (1 + np.sqrt(5)) * k
    r = np.sqrt(1 - z**2)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1)


def crumpled_paper(radius: float, rng: np.random.Generator, color: Color) -> Any:
    """A lump of folds with a flat underside, so that it does not roll; it moves freely.

    Frame: centre of the lump, `height(radius)` above the underside.
    """
    spec, body = part()
    directions = _sphere(90)
    hull = ConvexHull(directions)
    faces = hull.simplices.copy()
    a, b, c = (directions[faces[:, i]] for i in range(3))
    inward = np.einsum("fi,fi->f", np.cross(b - a, c - a), a) < 0
    faces[inward] = faces[inward][:, ::-1]
    creases = rng.normal(size=(7, 3))
    phase = rng.uniform(0, 2 * np.pi, size=7)
    folds = np.sin(4.0 * directions @ creases.T / np.linalg.norm(creases, axis=1) + phase).mean(axis=1)
    scale = radius * (0.92 + 0.3 * folds + rng.uniform(-0.07, 0.07, size=len(directions)))
    points = directions * np.clip(scale, 0.72 * radius, 1.05 * radius)[:, None]
    foot = (directions[:, 2] < -_FOOT) | (points[:, 2] < -_FOOT * radius)
    points[foot, 2] = -_FOOT * radius
    spec.add_mesh(name="lump", uservert=points.ravel(), userface=faces.astype(np.int32).ravel())
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname="lump",
        rgba=rgba(color),
        density=PAPER,
        friction=[1, 0.02, 1e-3],
    )
    return spec


def height(radius: float) -> float:
    """Of the frame of a lump of `radius` above the table."""
    return _FOOT * radius
