"""Grounds for other things: boxes, tables and boards on which things lie anywhere, and boards with holes."""

from itertools import pairwise
from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.parts import lathe
from imop.sim.parts.shapes import PLASTIC, WOOD, Color, box, cylinder, part
from imop.training.synthetic.families.composites import primitive
from imop.training.synthetic.families.solids import HALF_TURN
from imop.training.synthetic.families.thing import Floor, Hold, Thing, from_above, paint, revolution, up
from imop.types import FloatArray


def container(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A crate, a drawer with a front, a box with a partition, or a round dish, in which things lie."""
    spec, body = part(fixed=True)
    first, second = paint(color), paint(color)
    x, y, z = shape.uniform(0.09, 0.16), shape.uniform(0.08, 0.14), shape.uniform(0.02, 0.08)
    wall, style = shape.uniform(0.003, 0.008), shape.random()
    if style < 0.25:
        r = (x + y) / 2
        cylinder(body, r, 0, wall, first, PLASTIC)
        lathe.shell(spec, body, "rim", [(r, wall), (r * 1.08, 0.6 * z)], wall, second, PLASTIC, 20)
        inside = Floor((0, 0, wall), (0.66 * r, 0.66 * r))
        return Thing(spec, spots=(up(z=wall),), floors=(inside,), symmetry=revolution())
    walls(body, (x, y, z), wall, first, second)
    floors, symmetry = (Floor((0, 0, wall), (x - wall, y - wall)),), HALF_TURN
    if style < 0.5:
        out = shape.uniform(0.005, 0.02)
        box(body, (x, -y - 0.01, 0), (x + out, y + 0.01, z + 0.01), paint(color), WOOD)
        box(body, (x + out, -0.3 * y, 0.5 * z), (x + out + 0.015, 0.3 * y, 0.5 * z + 0.01), second, WOOD)
        symmetry = np.eye(4)[None]
    elif style < 0.75:
        at = shape.uniform(0.1, 0.35) * x
        box(body, (at, wall - y, wall), (at + wall, y - wall, 0.8 * z), second, WOOD)
        half = (at + x - wall) / 2
        floors = (Floor((at - half, 0, wall), (half, y - wall)),)
        symmetry = np.eye(4)[None]
    grips = (Hold(from_above((0, y - wall / 2, z - 0.012)), width=wall),)
    return Thing(spec, grips, spots=(up(z=wall),), floors=floors, symmetry=symmetry)


def walls(body: Any, size: tuple[float, float, float], wall: float, ground: Color, sides: Color) -> None:
    """A box without a lid, of half sizes `size[:2]` and height `size[2]`, metres."""
    x, y, z = size
    box(body, (-x, -y, 0), (x, y, wall), ground, WOOD)
    for side in (-1, 1):
        a, b = sorted((side * x, side * (x - wall)))
        box(body, (a, -y, wall), (b, y, z), sides, WOOD)
        a, b = sorted((side * y, side * (y - wall)))
        box(body, (wall - x, a, wall), (x - wall, b, z), sides, WOOD)


def bench(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A board or low table with random pieces along one side, room for things on the rest of it."""
    spec, body = part(fixed=True)
    x, y, high = shape.uniform(0.1, 0.16), shape.uniform(0.08, 0.14), shape.uniform(0.006, 0.02)
    first = paint(color)
    if shape.random() < 0.4:
        leg, high = shape.uniform(0.006, 0.012), shape.uniform(0.03, 0.08)
        box(body, (-x, -y, high - 0.01), (x, y, high), first, WOOD)
        legs = paint(color)
        for i in (-1, 1):
            for j in (-1, 1):
                p = (i * (x - 2 * leg), j * (y - 2 * leg))
                box(body, (p[0] - leg, p[1] - leg, 0), (p[0] + leg, p[1] + leg, high - 0.01), legs, WOOD)
    else:
        box(body, (-x, -y, 0), (x, y, high), first, WOOD)
    edge = 0.0
    for k in range(int(shape.integers(1, 4))):
        piece = primitive(shape).moved(se3.make(se3.euler(z=shape.uniform(-np.pi, np.pi))))
        deep, tall = piece.reach(np.array([1.0, 0, 0])), piece.reach(np.array([0, 0, -1.0]))
        at = (x - min(deep, 0.6 * x), shape.uniform(-0.8, 0.8) * y, high + tall - 0.002)
        piece.moved(se3.make(p=at)).add(spec, body, f"piece{k}", paint(color))
        edge = max(edge, 2 * min(deep, 0.6 * x))
    room = max(0.07, x - edge / 2)
    return Thing(spec, spots=(up(room - x, 0, high),), floors=(Floor((room - x, 0, high), (room, y)),))


def pierced(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A board with one to three holes, through it or down to a lower level, perhaps on legs or with a rim."""
    spec, body = part(fixed=True)
    x, y, thick = shape.uniform(0.09, 0.16), shape.uniform(0.07, 0.12), shape.uniform(0.01, 0.04)
    raised = shape.uniform(0.015, 0.05) if shape.random() < 0.35 else 0.0
    first, rim = paint(color), paint(color)
    count = int(shape.integers(1, 4))
    edges = np.linspace(-x, x, count + 1)
    through, lower = bool(shape.random() < 0.5), shape.uniform(0.1, 0.6) * thick
    holes = []
    for k, (a, b) in enumerate(pairwise(edges)):
        wide = (b - a) * shape.uniform(0.35, 0.7) / 2
        deep = min(y * 0.7, wide * shape.uniform(0.6, 2.0))
        cx = (a + b) / 2 + shape.uniform(-0.5, 0.5) * ((b - a) / 2 - wide)
        cy = shape.uniform(-0.7, 0.7) * (y - deep)
        _around(body, (a, -y, b, y), (cx, cy, wide, deep), (raised, raised + thick), first)
        bottom = 0.0 if through else raised + lower
        if not through:
            ground = paint(color)
            box(body, (cx - wide, cy - deep, raised), (cx + wide, cy + deep, bottom), ground, WOOD)
        if shape.random() < 0.35:
            _collar(spec, body, f"collar{k}", (cx, cy, raised + thick), min(wide, deep), rim)
        holes.append(up(cx, cy, bottom))
    if raised:
        for i in (-1, 1):
            for j in (-1, 1):
                lo, hi = np.array([i * x, j * y]), np.array([i * (x - 0.014), j * (y - 0.014)])
                box(body, (*np.minimum(lo, hi), 0), (*np.maximum(lo, hi), raised), rim, WOOD)
    if shape.random() < 0.4:
        box(body, (-x, y, raised), (x, y + 0.006, raised + thick + shape.uniform(0.004, 0.02)), rim, WOOD)
    # A stripe along one side says which end is which.
    top = raised + thick
    box(body, (-x, -y, top), (shape.uniform(-0.2, 0.9) * x, -0.93 * y, top + 0.0008), paint(color), PLASTIC)
    return Thing(spec, spots=tuple(holes), holes=tuple(holes))


def _around(
    body: Any,
    field: tuple[float, float, float, float],
    hole: tuple[float, float, float, float],
    levels: tuple[float, float],
    color: Color,
) -> None:
    """Four boxes that fill a rectangle (x0, y0, x1, y1) but for a hole (x, y, half sizes)."""
    (x0, y0, x1, y1), (cx, cy, wide, deep), (low, high) = field, hole, levels
    box(body, (x0, y0, low), (cx - wide, y1, high), color, WOOD)
    box(body, (cx + wide, y0, low), (x1, y1, high), color, WOOD)
    box(body, (cx - wide, y0, low), (cx + wide, cy - deep, high), color, WOOD)
    box(body, (cx - wide, cy + deep, low), (cx + wide, y1, high), color, WOOD)


def _collar(
    spec: Any, body: Any, name: str, p: tuple[float, float, float], radius: float, color: Color
) -> None:
    """A flat ring around a hole."""
    inner = body.add_body(name=name, pos=list(p))
    lathe.shell(
        spec, inner, name, [(radius + 0.006, 0.0), (radius + 0.006, 0.004)], 0.006, color, PLASTIC, 16
    )


def sunken(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A round or cornered board with one round hole off its middle, as a stove or a cup holder."""
    spec, body = part(fixed=True)
    r, hole = shape.uniform(0.07, 0.11), shape.uniform(0.02, 0.04)
    low, high = shape.uniform(0.0, 0.02), shape.uniform(0.025, 0.05)
    first, second = paint(color), paint(color)
    at, angle = hole + 0.012 + shape.uniform(0.0, 0.4) * r, shape.uniform(-np.pi, np.pi)
    inner = body.add_body(name="well", pos=[0, 0, 0])
    wide = hole + at
    lathe.shell(spec, inner, "well", [(wide, low), (wide, high)], at, first, PLASTIC, 20)
    if shape.random() < 0.6:
        cylinder(inner, hole, 0, max(low, 0.003), second, PLASTIC)
    end = np.array([np.cos(angle), np.sin(angle)]) * (wide - 0.004)
    half = shape.uniform(0.012, 0.03)
    tab = (end[0], end[1], (low + high) / 2)
    flap = body.add_body(name="tab", pos=list(tab), quat=se3.to_wxyz(se3.make(se3.euler(z=angle))))
    box(
        flap, (0, -half, -(high - low) / 2), (shape.uniform(0.02, 0.06), half, (high - low) / 2), second, WOOD
    )
    bottom = up(z=max(low, 0.003))
    return Thing(spec, spots=(bottom,), holes=(bottom, bottom @ _over(high)), symmetry=np.eye(4)[None])


def _over(high: float) -> FloatArray:
    """(4, 4) a place on the edge of a hole instead of in it."""
    return up(z=high)
