"""A jar and a lid with a two-start thread: two lugs in the lid run between flanks on the neck."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from imop.sim.parts import lathe
from imop.sim.parts.shapes import METAL, PLASTIC, WOOD, Color, box, cylinder, hull_mesh, mesh, part
from imop.types import FloatArray

TURN = np.pi / 2
"""Clockwise, from where the lid goes on until it is tight, radians."""
DROP = 0.004
"""How far the lid comes down with that, metres."""
TOP = 0.004
SKIRT = 0.016
LID_HEIGHT = TOP + SKIRT
NECK_LENGTH, NECK_WALL = 0.026, 0.003
_LUG_LOW, _LUG = -0.0115, 0.003
"""Underside and thickness of a lug, below the lid's inner top."""
_FLANK, _DEPTH, _PLAY = 0.002, 0.003, 0.0007
_LUG_GAP, _SKIRT_GAP, _SKIRT_WALL = 0.001, 0.0042, 0.003


@dataclass(frozen=True)
class JarShape:
    """Sizes of a jar, metres.

    Attributes:
        neck: radius of the neck without its thread.
        radius: of the body.
        height: of the mouth above the table.
    """

    neck: float
    radius: float
    height: float

    @property
    def lid_radius(self) -> float:
        """Outer radius of the lid."""
        return self.neck + _SKIRT_GAP + _SKIRT_WALL


def jar(shape: JarShape, color: Color, content_color: Color, label_color: Color) -> Any:
    """An open jar fixed on the table; frame: centre of the mouth, label towards +x.

    A lid goes on with its x axis along the jar's (or against it), `DROP` too high, and is tight after
    a clockwise `TURN`.
    """
    spec, body = part(fixed=True)
    r, base, shoulder = shape.radius, -shape.height, -NECK_LENGTH
    profile = [(0.9 * r, base), (r, base + 0.006), (r, shoulder - 0.012), (shape.neck + 0.002, shoulder)]
    lathe.solid(spec, body, "belly", profile, color, PLASTIC)
    neck = [(shape.neck, shoulder), (shape.neck, 0.0)]
    lathe.shell(spec, body, "neck", neck, NECK_WALL, color, PLASTIC, segments=20)
    cylinder(body, shape.neck - NECK_WALL, shoulder, -0.015, content_color, WOOD)
    middle, half = (base + shoulder) / 2, 0.3 * (shape.height - NECK_LENGTH)
    box(body, (0.9 * r, -0.45 * r, middle - half), (r + 0.001, 0.45 * r, middle + half), label_color, PLASTIC)
    thread(spec, body, shape.neck, color)
    return spec


def _lug_low(angle: float) -> float:
    """Height of a lug's underside in the jar's frame after a clockwise turn by `angle`."""
    return _LUG_LOW + DROP * (1 - float(np.clip(angle / TURN, 0, 1)))


def thread(spec: Any, body: Any, neck: float, color: Color) -> None:
    """Flanks below and above the way of each lug, and a stop at its end."""

    def below(angle: float) -> tuple[float, float]:
        top = _lug_low(angle) - _PLAY
        return top - _FLANK, top

    def above(angle: float) -> tuple[float, float]:
        bottom = _lug_low(angle) + _LUG + _PLAY
        return bottom, bottom + _FLANK

    def stop(angle: float) -> tuple[float, float]:
        return below(angle)[0], above(angle)[1]

    pieces = [
        *(("below", below, a, b) for a, b in pairwise(np.radians(np.linspace(-15, 105, 9)))),
        *(("above", above, a, b) for a, b in pairwise(np.radians(np.linspace(30, 105, 6)))),
        ("stop", stop, np.radians(99), np.radians(105)),
    ]
    for i, (kind, height, start, end) in enumerate(pieces):
        name = f"{kind}{i}"
        hull_mesh(spec, name, _piece(neck, height, start, end))
        for turn in (0.0, np.pi):
            mesh(body, name, color, PLASTIC, yaw=turn)


def _piece(
    neck: float, height: Callable[[float], tuple[float, float]], start: float, end: float
) -> FloatArray:
    """(8, 3) corners of a piece of thread between two clockwise angles."""
    return np.array(
        [
            (r * np.cos(angle), -r * np.sin(angle), z)
            for angle in (start, end)
            for r in (neck - 0.001, neck + _DEPTH)
            for z in height(angle)
        ]
    )


def screw_lid(shape: JarShape, color: Color, mark_color: Color) -> Any:
    """The lid for a jar of `shape`; it moves freely. Frame: centre of its upper face, mark along x."""
    spec, body = part()
    outer, inner = shape.lid_radius, shape.neck + _SKIRT_GAP
    cylinder(body, outer, -TOP, -0.001, color, METAL)
    x, y = 0.85 * outer, 0.12 * outer
    box(body, (-x, -y, -TOP / 2), (x, y, 0), mark_color, PLASTIC)
    skirt = [(outer, -LID_HEIGHT), (outer, -TOP)]
    lathe.shell(spec, body, "skirt", skirt, _SKIRT_WALL, color, METAL, segments=20)
    low, near = _LUG_LOW - TOP, shape.neck + _LUG_GAP
    for side in (-1, 1):
        a, b = sorted((side * near, side * (inner + 0.001)))
        box(body, (a, -0.002, low), (b, 0.002, low + _LUG), color, METAL)
    return spec
