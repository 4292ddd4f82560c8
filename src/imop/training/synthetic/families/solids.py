"""Boxes, trays, racks, flat targets, extruded letters."""

import numpy as np

from imop.geometry import se3
from imop.sim.parts.shapes import PAPER, PLASTIC, WOOD, Color, box, cylinder, part
from imop.training.synthetic.families.thing import Floor, Hold, Thing, from_above, from_side, paint, up
from imop.types import FloatArray

HALF_TURN = np.stack([np.eye(4), se3.make(se3.euler(z=np.pi))])
QUARTER_TURNS = np.stack([se3.make(se3.euler(z=k * np.pi / 2)) for k in range(4)])


def block(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A box, a cube or a carton with a printed side; frame: centre of its base."""
    x, y, z = shape.uniform(0.02, 0.075), shape.uniform(0.02, 0.07), shape.uniform(0.02, 0.12)
    kind = shape.random()
    if kind < 0.35:
        x = y = z = shape.uniform(0.025, 0.06)
    spec, body = part(fixed=True)
    first = paint(color)
    box(body, (-x / 2, -y / 2, 0), (x / 2, y / 2, z), first, WOOD)
    symmetry = _cube_turns(z) if kind < 0.35 else _box_turns(z)
    if kind > 0.7:
        second = paint(color)
        e = 0.0008
        box(body, (x / 2, -0.4 * y, 0.2 * z), (x / 2 + e, 0.4 * y, 0.75 * z), second, PAPER)
        low = shape.uniform(0.1, 0.4)
        box(body, (-0.4 * x, -y / 2 - e, low * z), (0.4 * x, y / 2 + e, (low + 0.3) * z), second, PAPER)
        symmetry = np.eye(4)[None]
    grips = [Hold(from_above((0, 0, z - min(0.02, z / 2))), width=y)]
    grips.append(Hold(from_above((0, 0, z - min(0.02, z / 2)), np.pi / 2), width=x))
    if z > 0.06:
        grips.append(Hold(from_side((0, 0, 0.6 * z), down=shape.uniform(0, 0.7)), width=y))
    lying = () if kind < 0.35 else (se3.euler(x=np.pi / 2), se3.euler(y=np.pi / 2))
    return Thing(spec, tuple(grips), spots=(up(z=z),), symmetry=symmetry, rests=(np.eye(3), *lying))


def _box_turns(z: float) -> FloatArray:
    """The three half turns of a box whose base is the origin."""
    center = up(z=z / 2)
    turns = [np.eye(3), *(se3.euler(**{axis: np.pi}) for axis in "xyz")]
    return np.stack([center @ se3.make(R) @ se3.invert(center) for R in turns])


def _cube_turns(z: float) -> FloatArray:
    """The 24 turns of a cube whose base is the origin."""
    center = up(z=z / 2)
    tips = [se3.euler(x=k * np.pi / 2) for k in range(4)] + [se3.euler(y=k * np.pi / 2) for k in (1, 3)]
    turns = [tip @ se3.euler(z=k * np.pi / 2) for tip in tips for k in range(4)]
    return np.stack([center @ se3.make(R) @ se3.invert(center) for R in turns])


def tray(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A rectangular tray or crate, open above; frame: centre of its base."""
    x, y, z = shape.uniform(0.06, 0.14), shape.uniform(0.05, 0.1), shape.uniform(0.02, 0.07)
    wall = shape.uniform(0.004, 0.007)
    spec, body = part(fixed=True)
    first, second = paint(color), paint(color)
    sides = first if shape.random() < 0.6 else second
    box(body, (-x, -y, 0), (x, y, wall), first, WOOD)
    for side in (-1, 1):
        a, b = sorted((side * x, side * (x - wall)))
        box(body, (a, -y, wall), (b, y, z), sides, WOOD)
        a, b = sorted((side * y, side * (y - wall)))
        box(body, (wall - x, a, wall), (x - wall, b, z), sides, WOOD)
    grips = (Hold(from_above((0, y - wall / 2, z - 0.012)), width=wall),)
    spots = (up(z=wall), up(x / 2, 0, wall), up(-x / 2, 0, wall))
    floors = (Floor((0, 0, wall), (x - wall, y - wall)),)
    return Thing(spec, grips, spots=spots, symmetry=HALF_TURN, floors=floors)


def rack(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A rack: uprights in a row on a board, things stand between them; frame: centre of its base."""
    count, pitch = int(shape.integers(3, 6)), shape.uniform(0.03, 0.05)
    y, z, rod = shape.uniform(0.03, 0.07), shape.uniform(0.05, 0.12), shape.uniform(0.004, 0.007)
    half = count * pitch / 2
    spec, body = part(fixed=True)
    base, bars = paint(color), paint(color)
    box(body, (-half, -y, 0), (half, y, 0.012), base, WOOD)
    ends = (np.arange(count) - (count - 1) / 2) * pitch
    for x in ends:
        for side in (-0.7, 0.7):
            box(body, (x - rod, side * y - rod, 0.012), (x + rod, side * y + rod, z), bars, WOOD)
    spots = tuple(up(float(x), 0, 0.012) for x in (ends[:-1] + ends[1:]) / 2)
    grips = (Hold(from_above((0, y - 0.006, 0.02)), width=0.012),)
    return Thing(spec, grips, spots=spots, symmetry=HALF_TURN)


def target(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A flat coloured mark on the table; frame: centre of its base."""
    r, z = shape.uniform(0.03, 0.08), shape.uniform(0.001, 0.006)
    spec, body = part(fixed=True)
    if shape.random() < 0.4:
        cylinder(body, r, 0, z, paint(color), PLASTIC)
        cylinder(body, r / 2, z, z + 0.0005, paint(color), PLASTIC)
        symmetry = np.stack([se3.make(se3.euler(z=2 * np.pi * k / 12)) for k in range(12)])
        return Thing(spec, pokes=(Hold(from_above((0, 0, z))),), spots=(up(z=z),), symmetry=symmetry)
    y = r * shape.uniform(0.4, 1.0)
    box(body, (-r, -y, 0), (r, y, z), paint(color), PLASTIC)
    if shape.random() < 0.5:
        box(body, (0.2 * r, -0.7 * y, 0), (0.8 * r, 0.7 * y, z + 0.0005), paint(color), PLASTIC)
        return Thing(spec, pokes=(Hold(from_above((0, 0, z))),), spots=(up(z=z), up(0.5 * r, 0, z)))
    return Thing(spec, spots=(up(z=z),), symmetry=HALF_TURN)


_STROKES: dict[str, tuple[tuple[float, float, float, float], ...]] = {
    "L": ((-0.5, -0.8, -0.2, 0.8), (-0.2, -0.8, 0.5, -0.5)),
    "T": ((-0.15, -0.8, 0.15, 0.5), (-0.55, 0.5, 0.55, 0.8)),
    "F": ((-0.5, -0.8, -0.2, 0.8), (-0.2, 0.5, 0.5, 0.8), (-0.2, -0.1, 0.3, 0.2)),
    "E": ((-0.5, -0.8, -0.2, 0.8), (-0.2, 0.5, 0.5, 0.8), (-0.2, -0.15, 0.4, 0.15), (-0.2, -0.8, 0.5, -0.5)),
    "U": ((-0.55, -0.8, -0.25, 0.8), (0.25, -0.8, 0.55, 0.8), (-0.25, -0.8, 0.25, -0.5)),
    "P": (
        (-0.5, -0.8, -0.2, 0.8),
        (-0.2, 0.5, 0.5, 0.8),
        (0.2, 0.0, 0.5, 0.5),
        (-0.2, -0.15, 0.5, 0.1),
    ),
    "J": ((0.1, -0.8, 0.4, 0.8), (-0.5, -0.8, 0.1, -0.5), (-0.5, -0.5, -0.25, -0.2)),
}


def letter(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A letter cut out of a board, flat or upright; frame: centre of its underside."""
    strokes = _STROKES[str(shape.choice(list(_STROKES)))]
    size, z = shape.uniform(0.03, 0.07), shape.uniform(0.012, 0.035)
    spec, body = part(fixed=True)
    first = paint(color)
    for x0, y0, x1, y1 in strokes:
        _stroke(body, size, z, (x0, y0, x1, y1), first)
    grips = []
    for x0, y0, x1, y1 in strokes:
        along_y = (y1 - y0) > (x1 - x0)
        center = (size * (x0 + x1) / 2, size * (y0 + y1) / 2, z / 2)
        width = size * min(x1 - x0, y1 - y0)
        grips.append(Hold(from_above(center, np.pi / 2 if along_y else 0.0), width=width))
    return Thing(spec, tuple(grips), spots=(up(z=z),), rests=(np.eye(3), se3.euler(x=np.pi / 2)))


def _stroke(body: object, size: float, z: float, at: tuple[float, float, float, float], color: Color) -> None:
    x0, y0, x1, y1 = (size * v for v in at)
    box(body, (x0, y0, 0), (x1, y1, z), color, WOOD)
