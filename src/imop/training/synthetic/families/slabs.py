"""Slabs: sorters in which thin ones stand, single ones that stand or lie, piles."""

from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.parts.shapes import PLASTIC, WOOD, box, capsule, part
from imop.training.synthetic.families.fittings import TIP, rod, slanted
from imop.training.synthetic.families.solids import HALF_TURN
from imop.training.synthetic.families.thing import Hold, Thing, from_above, paint, up
from imop.types import FloatArray


def sorter(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A toast rack, plate rack or file sorter, some slots with a slab in them; frame: centre of its base."""
    count, pitch = int(shape.integers(3, 8)), shape.uniform(0.022, 0.038)
    y, z, base = shape.uniform(0.04, 0.09), shape.uniform(0.03, 0.1), shape.uniform(0.006, 0.014)
    half, lean = count * pitch / 2, shape.uniform(-0.3, 0.3) * (shape.random() < 0.4)
    spec, body = part(fixed=True)
    box(body, (-half - 0.006, -y, 0), (half + 0.006, y, base), paint(color), WOOD)
    # Something in front says which end is which.
    box(body, (half + 0.006, -0.4 * y, 0), (half + 0.012, 0.4 * y, 0.8 * base), paint(color), PLASTIC)
    dividers, style = paint(color), shape.random()
    R = se3.euler(y=lean)
    for k in range(count + 1):
        x = k * pitch - half
        if style < 0.4:
            slanted(body, (x + np.tan(lean) * z / 2, 0, base + z / 2), (0.0015, 0.9 * y, z / 2), R, dividers)
        elif style < 0.8:
            ends = [(x, side * 0.7 * y, base) for side in (-1, 1)]
            tops = [(x + np.tan(lean) * z, side * 0.7 * y, base + z) for side in (-1, 1)]
            for a, b in ((ends[0], tops[0]), (tops[0], tops[1]), (tops[1], ends[1])):
                capsule(body, a, b, 0.002, dividers, PLASTIC)
    shared = paint(color) if shape.random() < 0.3 else None
    spots: list[FloatArray] = []
    for k in range(count):
        x = (k + 0.5) * pitch - half
        if shape.random() < 0.45 and (len(spots) or k < count - 1):
            tall, wide = shape.uniform(0.06, 0.14), shape.uniform(0.5, 1.1) * y
            thick, shift = shape.uniform(0.002, 0.3 * pitch), shape.uniform(-0.3, 0.3) * y
            center = (x + np.tan(lean) * tall / 2, shift, base + tall / 2)
            slanted(body, center, (thick, wide, tall / 2), R, shared or paint(color))
        else:
            spots.append(se3.make(R @ se3.euler(z=np.pi / 2), (x, 0, base)))
    return Thing(spec, spots=tuple(spots))


def slab(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A tile, card, cutting board, tray, tablet or cassette; frame: centre of its underside or lower edge."""
    x, y, t = shape.uniform(0.03, 0.1), shape.uniform(0.022, 0.07), shape.uniform(0.002, 0.009)
    stands = bool(shape.random() < 0.6)
    if not stands:
        y = min(y, 0.037)
    spec, body = part(fixed=True)
    T_body_flat = se3.make(se3.euler(x=np.pi / 2) if stands else np.eye(3), (0, 0, y if stands else t))
    flat = body.add_body(name="flat", pos=T_body_flat[:3, 3], quat=se3.to_wxyz(T_body_flat))
    box(flat, (-x, -y, -t), (x, y, t), paint(color), PLASTIC)
    symmetry = _DECORATIONS[int(shape.integers(len(_DECORATIONS)))](shape, color, flat, (x, y, t))
    at = shape.uniform(-0.5, 0.5) * x
    deep = min(0.02, y)
    grip = (at, y - deep, 0.0) if stands else (at, 0.0, max(0.3 * t, TIP - t))
    p = se3.apply(T_body_flat, np.array([grip]))[0]
    grips = [Hold(from_above(tuple(p.tolist())), width=2 * t if stands else 2 * y)]
    if stands and x < 0.06:
        end = se3.euler(y=np.pi / 2)
        return _thing(spec, grips, symmetry, T_body_flat, (np.eye(3), end))
    return _thing(spec, grips, symmetry, T_body_flat, (np.eye(3),))


def _thing(
    spec: Any,
    grips: list[Hold],
    symmetry: FloatArray,
    T_body_flat: FloatArray,
    rests: tuple[FloatArray, ...],
) -> Thing:
    turned = T_body_flat @ symmetry @ se3.invert(T_body_flat)
    return Thing(spec, tuple(grips), symmetry=turned, rests=rests)


Size = tuple[float, float, float]


def _plain(shape: np.random.Generator, color: np.random.Generator, body: Any, size: Size) -> FloatArray:
    """A tile or card, perhaps with a stripe around: three half turns."""
    x, y, t = size
    if shape.random() < 0.5:
        w = shape.uniform(0.1, 0.5) * x
        box(body, (-w, -y - 0.0006, -t - 0.0006), (w, y + 0.0006, t + 0.0006), paint(color), PLASTIC)
    return np.stack([se3.make(R) for R in (np.eye(3), *(se3.euler(**{a: np.pi}) for a in "xyz"))])


def _screen(shape: np.random.Generator, color: np.random.Generator, body: Any, size: Size) -> FloatArray:
    """A tablet: a screen on one side, and a button under it or not."""
    x, y, t = size
    box(body, (-0.8 * x, -0.88 * y, t - 0.001), (0.8 * x, 0.88 * y, t + 0.0006), paint(color), PLASTIC)
    if shape.random() < 0.4:
        return HALF_TURN
    box(body, (0.84 * x, -0.4 * y, t), (0.97 * x, 0.4 * y, t + 0.0015), paint(color), PLASTIC)
    return np.eye(4)[None]


def _board(shape: np.random.Generator, color: np.random.Generator, body: Any, size: Size) -> FloatArray:
    """A cutting board: a tongue at one end, alike from above and below."""
    x, y, t = size
    box(body, (x, -0.3 * y, -t), (x + shape.uniform(0.02, 0.05), 0.3 * y, t), paint(color), WOOD)
    return np.stack([np.eye(4), se3.make(se3.euler(x=np.pi))])


def _rim(shape: np.random.Generator, color: np.random.Generator, body: Any, size: Size) -> FloatArray:
    """A tray or a frame with a rim on one side."""
    x, y, t = size
    w, h, edge = 0.005, t + shape.uniform(0.003, 0.008), paint(color)
    for side in (-1, 1):
        a, b = sorted((side * (x - w), side * x))
        box(body, (a, -y, t), (b, y, h), edge, PLASTIC)
        a, b = sorted((side * (y - w), side * y))
        box(body, (w - x, a, t), (x - w, b, h), edge, PLASTIC)
    return HALF_TURN


def _reels(shape: np.random.Generator, color: np.random.Generator, body: Any, size: Size) -> FloatArray:
    """A cassette: two reels and a label along one edge."""
    x, y, t = size
    reel = paint(color)
    for side in (-0.45, 0.45):
        center = (side * x, -0.1 * y)
        rod(body, (*center, t), (*center, t + 0.001), 0.3 * min(x, y), reel)
    box(body, (-0.85 * x, 0.4 * y, t - 0.001), (0.85 * x, 0.85 * y, t + 0.0006), paint(color), PLASTIC)
    return np.eye(4)[None]


_DECORATIONS = (_plain, _screen, _board, _rim, _reels)


def pile(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A pile of tiles of different sizes, each turned a little; frame: centre of its base."""
    spec, body = part(fixed=True)
    z, lean = 0.0, shape.uniform(0, 0.5)
    x, y = 0.0, 0.0
    for _ in range(int(shape.integers(2, 6))):
        x, y, t = shape.uniform(0.035, 0.09), shape.uniform(0.03, 0.07), shape.uniform(0.003, 0.012)
        yaw, shift = shape.uniform(-lean, lean), shape.uniform(-0.01, 0.01, 2)
        slanted(body, (*shift, z + t), (x, y, t), se3.euler(z=yaw), paint(color))
        z += 2 * t
    box(body, (0.3 * x, 0.3 * y, z), (0.6 * x, 0.5 * y, z + 0.001), paint(color), PLASTIC)
    pokes = (Hold(from_above((0, 0, z))),)
    return Thing(spec, pokes=pokes, spots=(up(z=z),))
