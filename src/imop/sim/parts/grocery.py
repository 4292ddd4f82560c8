"""Nine groceries at the sizes they are sold in: cartons, cans, a jar, a bottle."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from imop.sim.parts import lathe
from imop.sim.parts.shapes import Color, box, cylinder, hull_mesh, mesh, part
from imop.types import FloatArray

_DENSITY = 300.0
"""Lighter than most contents, so that nothing bends the arm."""
_PRINT = 0.0006
"""How far print stands out, so that cameras see it and not what is below."""
_TIN: Color = (0.75, 0.75, 0.77)


@dataclass(frozen=True)
class Grocery:
    """A product that stands upright; metres.

    Attributes:
        name: as one asks for it.
        length: along x, the longer side.
        width: along y, between the fingers of a hand above it; below 8 cm.
        height: along z.
        add: draws it on (spec, body, grocery, colour of the pack).
        color: of the pack.
    """

    name: str
    length: float
    width: float
    height: float
    add: Callable[[Any, Any, "Grocery", Color], None]
    color: Color


def grocery(kind: Grocery, shade: Color = (0.0, 0.0, 0.0)) -> Any:
    """A product that moves freely; frame: centre of its top, +z up. `shade` is added to the pack's colour."""
    spec, body = part()
    r, g, b = np.clip(np.add(kind.color, shade), 0, 1).tolist()
    kind.add(spec, body, kind, (r, g, b))
    return spec


def _carton(spec: Any, body: Any, kind: Grocery, color: Color) -> None:
    x, y, h = kind.length / 2, kind.width / 2, kind.height
    box(body, (-x, -y, -h), (x, y, 0), color, _DENSITY)
    pale = tuple(0.35 * c + 0.65 for c in color)
    box(body, (-0.8 * x, -y - _PRINT, -0.55 * h), (0.8 * x, y + _PRINT, -0.15 * h), pale, 0)
    dark = tuple(0.4 * c for c in color)
    box(body, (-x - _PRINT, -0.5 * y, -0.9 * h), (x + _PRINT, 0.5 * y, -0.1 * h), dark, 0)


def _can(spec: Any, body: Any, kind: Grocery, color: Color) -> None:
    r, h, rim = kind.width / 2, kind.height, 0.004
    cylinder(body, r - 0.001, -h + rim, -rim, color, _DENSITY)
    for bottom in (-h, -rim):
        cylinder(body, r, bottom, bottom + rim, _TIN, _DENSITY)
    pale = tuple(0.2 * c + 0.8 for c in color)
    cylinder(body, r - 0.001 + _PRINT, -0.45 * h, -0.15 * h, pale, 0)


def _flat_can(spec: Any, body: Any, kind: Grocery, color: Color) -> None:
    h, rim = kind.height, 0.005
    outline = _rounded(kind.length - 0.002, kind.width - 0.002, 0.018)
    _extrude(spec, body, "label", outline, -h + rim, -rim, color)
    outline = _rounded(kind.length, kind.width, 0.019)
    _extrude(spec, body, "bottom", outline, -h, -h + rim, _TIN)
    _extrude(spec, body, "top", outline, -rim, 0, _TIN)


def _jar(spec: Any, body: Any, kind: Grocery, color: Color) -> None:
    r, h, lid = kind.length / 2, kind.height, 0.026
    glass = [(r, -h), (r, -0.42 * h), (0.78 * r, -lid - 0.002)]
    lathe.solid(spec, body, "glass", glass, color, _DENSITY)
    cylinder(body, kind.width / 2, -lid, 0, (0.25, 0.13, 0.06), _DENSITY)
    label = 0.9 * np.asarray((1.0, 0.9, 0.75))
    cylinder(body, r + _PRINT, -0.9 * h, -0.5 * h, tuple(label.tolist()), 0)


def _bottle(spec: Any, body: Any, kind: Grocery, color: Color) -> None:
    h, cap = kind.height, 0.04
    shoulder, foot = -0.30 * h, -h
    wide = _rounded(kind.length, 0.058, 0.028)
    neck = _rounded(0.036, 0.036, 0.0179)
    points = [_at(wide, foot), _at(wide, shoulder), _at(neck, -cap)]
    hull_mesh(spec, "flask", np.concatenate(points))
    mesh(body, "flask", color, _DENSITY)
    nozzle = [(kind.width / 2, -cap), (kind.width / 2, -0.016), (0.009, 0.0)]
    lathe.solid(spec, body, "nozzle", nozzle, (0.85, 0.1, 0.05), _DENSITY)
    box(body, (-0.03, -0.029 - _PRINT, -0.8 * h), (0.03, 0.029 + _PRINT, -0.45 * h), (0.9, 0.15, 0.1), 0)


def _rounded(length: float, width: float, radius: float) -> FloatArray:
    """(32, 2) outline of a rectangle with round corners."""
    angles = np.linspace(0, np.pi / 2, 8)
    arc = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    centre = np.array([length / 2 - radius, width / 2 - radius])
    corners = [(1, 1), (-1, 1), (-1, -1), (1, -1)]
    return np.concatenate([(arc + centre) * corner for corner in corners])


def _at(outline: FloatArray, z: float) -> FloatArray:
    return np.column_stack([outline, np.full(len(outline), z)])


def _extrude(
    spec: Any, body: Any, name: str, outline: FloatArray, bottom: float, top: float, color: Color
) -> None:
    hull_mesh(spec, name, np.concatenate([_at(outline, bottom), _at(outline, top)]))
    mesh(body, name, color, _DENSITY)


GROCERIES = (
    Grocery("crackers", 0.158, 0.060, 0.210, _carton, (0.80, 0.10, 0.10)),
    Grocery("sugar", 0.089, 0.045, 0.175, _carton, (0.95, 0.85, 0.25)),
    Grocery("spam", 0.097, 0.050, 0.082, _flat_can, (0.10, 0.18, 0.55)),
    Grocery("soup", 0.066, 0.066, 0.101, _can, (0.80, 0.08, 0.08)),
    Grocery("tuna", 0.066, 0.066, 0.038, _can, (0.15, 0.35, 0.70)),
    Grocery("coffee", 0.076, 0.062, 0.140, _jar, (0.24, 0.14, 0.08)),
    Grocery("mustard", 0.095, 0.030, 0.190, _bottle, (0.95, 0.80, 0.05)),
    Grocery("berry jello", 0.085, 0.028, 0.073, _carton, (0.85, 0.15, 0.35)),
    Grocery("choco jello", 0.110, 0.035, 0.089, _carton, (0.40, 0.20, 0.10)),
)
