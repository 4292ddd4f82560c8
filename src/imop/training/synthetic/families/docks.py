"""Things at which what is held stays in the hand: low tables, garages, cradles, slots, rings on posts."""

from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.parts import lathe
from imop.sim.parts.shapes import METAL, PLASTIC, WOOD, Color, box, capsule, cylinder, part
from imop.training.synthetic.families.thing import Thing, paint, up
from imop.types import FloatArray

_SIDES = (-1.0, 1.0)


def dock(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A low table, a garage, a cradle, a slotted wall or a ring on a post; the open side is +x."""
    spec, body = part(fixed=True)
    style = int(shape.integers(5))
    keeps = (_under, _garage, _cradle, _slot, _eye)[style](shape, color, spec, body)
    if shape.random() < 0.5:
        # Something beside it that tells its sides, as a maker's plate or a switch does.
        low = -shape.uniform(0.05, 0.09)
        box(body, (low, -0.02, 0), (low + 0.02, 0.035, shape.uniform(0.01, 0.05)), paint(color), PLASTIC)
    return Thing(spec, keeps=keeps)


def _under(
    shape: np.random.Generator, color: np.random.Generator, spec: Any, body: Any
) -> tuple[FloatArray, ...]:
    x, y, z = shape.uniform(0.05, 0.1), shape.uniform(0.06, 0.12), shape.uniform(0.06, 0.14)
    board, legs, t = paint(color), paint(color), shape.uniform(0.006, 0.015)
    box(body, (-x, -y, z - t), (x, y, z), board, WOOD)
    for side in _SIDES:
        a, b = sorted((side * y, side * (y - 0.012)))
        box(body, (-x, a, 0), (x if shape.random() < 0.4 else 0.012 - x, b, z - t), legs, WOOD)
    box(body, (-x, -y, 0), (0.008 - x, y, shape.uniform(0.2, 0.9) * z), legs, WOOD)
    return (up(x + shape.uniform(0.0, 0.03), 0, 0.012), up(x, shape.uniform(-0.5, 0.5) * y, 0.012))


def _garage(
    shape: np.random.Generator, color: np.random.Generator, spec: Any, body: Any
) -> tuple[FloatArray, ...]:
    x, y, z, w = shape.uniform(0.04, 0.08), shape.uniform(0.035, 0.07), shape.uniform(0.03, 0.08), 0.008
    first, back = paint(color), paint(color)
    for side in _SIDES:
        a, b = sorted((side * y, side * (y - w)))
        box(body, (-x, a, 0), (x, b, z), first, WOOD)
    box(body, (-x, w - y, 0), (w - x, y - w, z), back, WOOD)
    return (up(shape.uniform(0.0, 0.8) * x, 0, 0.01), up(x + 0.02, 0, 0.5 * z))


def _cradle(
    shape: np.random.Generator, color: np.random.Generator, spec: Any, body: Any
) -> tuple[FloatArray, ...]:
    x, y, z = shape.uniform(0.04, 0.07), shape.uniform(0.04, 0.08), shape.uniform(0.02, 0.05)
    first, second = paint(color), paint(color)
    box(body, (-x, -y, 0), (x, y, z), first, PLASTIC)
    lean = shape.uniform(0.2, 0.6) * x
    box(body, (-x, -y, z), (lean - x, y, z + shape.uniform(0.03, 0.1)), second, PLASTIC)
    box(body, (0.7 * x, -0.8 * y, z), (0.85 * x, 0.8 * y, z + 0.012), second, PLASTIC)
    return (up(0.2 * x, 0, z + 0.003), up(0.3 * x, shape.uniform(-0.4, 0.4) * y, z + 0.02))


def _slot(
    shape: np.random.Generator, color: np.random.Generator, spec: Any, body: Any
) -> tuple[FloatArray, ...]:
    t, y, z = shape.uniform(0.01, 0.04), shape.uniform(0.05, 0.1), shape.uniform(0.1, 0.22)
    at, high = shape.uniform(-0.5, 0.5) * y, shape.uniform(0.45, 0.8) * z
    wide, tall = shape.uniform(0.004, 0.02), shape.uniform(0.004, 0.025)
    color_, plate = paint(color), paint(color)
    _wall_with_hole(body, (t, y, z), (at, high, wide, tall), color_)
    box(body, (-t - 0.03, -y, 0), (t + 0.03, y, 0.012), color_, WOOD)
    if shape.random() < 0.6:
        box(
            body,
            (t, at - 2.5 * wide, high + tall),
            (t + 0.003, at + 2.5 * wide, high + tall + 0.02),
            plate,
            METAL,
        )
    far = shape.uniform(0.0, 0.03)
    return (up(t + far, at, high - tall),)


def _wall_with_hole(
    body: Any,
    size: tuple[float, float, float],
    hole: tuple[float, float, float, float],
    color: Color,
) -> None:
    (t, y, z), (at, high, wide, tall) = size, hole
    box(body, (-t, -y, 0), (t, at - wide, z), color, WOOD)
    box(body, (-t, at + wide, 0), (t, y, z), color, WOOD)
    box(body, (-t, at - wide, 0), (t, at + wide, high - tall), color, WOOD)
    box(body, (-t, at - wide, high + tall), (t, at + wide, z), color, WOOD)


def _eye(
    shape: np.random.Generator, color: np.random.Generator, spec: Any, body: Any
) -> tuple[FloatArray, ...]:
    r, high = shape.uniform(0.02, 0.04), shape.uniform(0.06, 0.15)
    foot, ring = paint(color), paint(color)
    out = r + shape.uniform(0.02, 0.04)
    cylinder(body, shape.uniform(0.03, 0.05), 0, 0.012, foot, WOOD)
    capsule(body, (0, 0, 0.012), (0, 0, high), 0.006, foot, METAL)
    inner = body.add_body(name="eye", pos=[out, 0, high])
    lathe.shell(spec, inner, "eye", [(r, -0.006), (r, 0.006)], 0.006, ring, METAL, 16)
    capsule(body, (0, 0, high), (out - r + 0.003, 0, high), 0.005, ring, METAL)
    deep = se3.make(p=(out, 0, high - shape.uniform(0.0, 0.04)))
    return (deep,)
