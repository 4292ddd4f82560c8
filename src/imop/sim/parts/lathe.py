"""Turned shapes: a profile revolved about the z axis, in convex pieces that collide exactly as they look."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from imop.errors import InvalidInput
from imop.sim.parts.shapes import Color, hull_mesh, mesh
from imop.types import FloatArray

Profile = Sequence[tuple[float, float]]
"""(radius, height) points in metres, from the bottom to the top."""


def ring(profile: FloatArray, angles: FloatArray) -> FloatArray:
    """Points of `profile` (N, 2) at each of `angles` (M,): (M * N, 3)."""
    r, z = profile[:, 0], profile[:, 1]
    points = [np.stack([r * np.cos(a), r * np.sin(a), z], axis=1) for a in angles]
    return np.concatenate(points)


def _checked(profile: Profile) -> FloatArray:
    points = np.asarray(profile, dtype=float)
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < 2 or points[:, 0].min() < 0:
        raise InvalidInput("profile", f"{profile}", "two or more points (radius >= 0, height)")
    return points


def solid(
    spec: Any, body: Any, name: str, profile: Profile, color: Color, density: float, segments: int = 24
) -> None:
    """Add the convex solid of revolution that contains `profile`.

    Raises:
        InvalidInput: if the profile is not a list of (radius, height).
    """
    angles = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    hull_mesh(spec, name, np.unique(ring(_checked(profile), angles).round(7), axis=0))
    mesh(body, name, color, density)


def shell(
    spec: Any,
    body: Any,
    name: str,
    profile: Profile,
    thickness: float,
    color: Color,
    density: float,
    segments: int = 24,
) -> None:
    """Add a wall of `thickness` whose outer side is `profile`: one ring of wedges per stretch of the profile.

    Raises:
        InvalidInput: if the profile is not a list of (radius, height) or not wider than the wall.
    """
    outer = _checked(profile)
    if outer[:, 0].min() <= thickness:
        raise InvalidInput("profile", f"radius {outer[:, 0].min()}", f"radii above the thickness {thickness}")
    half = np.pi / segments
    for i, (low, high) in enumerate(pairwise(outer)):
        section = np.array([low, high, high - (thickness, 0), low - (thickness, 0)])
        wedge = f"{name}_{i}"
        hull_mesh(spec, wedge, ring(section, np.array([-half, half])))
        for k in range(segments):
            mesh(body, wedge, color, density, yaw=2 * half * k)
