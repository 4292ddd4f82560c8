"""Things that look almost the same turned by a quarter or a half: a small detail tells the side to act on."""

from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.parts import lathe
from imop.sim.parts.shapes import METAL, PLASTIC, WOOD, Color, box, capsule, cylinder, part
from imop.training.synthetic.families.cabinets import slide
from imop.training.synthetic.families.fittings import AHEAD, inner
from imop.training.synthetic.families.thing import (
    Hold,
    Moving,
    Thing,
    from_above,
    from_front,
    from_side,
    paint,
    up,
)


def _faces(body: Any, x: float, y: float, z: float, turns: int) -> list[Any]:
    """A body on each upright side of a block: z outwards, x down, in the middle of the side."""
    found = []
    for k in range(turns):
        angle = 2 * np.pi * k / turns
        far = x if turns == 2 or k % 2 == 0 else y
        p = se3.euler(z=angle) @ (far, 0, z / 2)
        found.append(inner(body, f"face{k}", se3.euler(z=angle) @ AHEAD, p))
    return found


def chest(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A chest with equal fronts on two or four sides; one is a drawer, which a keyhole or a label tells."""
    spec, body = part(fixed=True)
    turns = int(shape.choice((2, 4)))
    x, z = shape.uniform(0.06, 0.09), shape.uniform(0.06, 0.11)
    y = x if turns == 4 else shape.uniform(0.05, 0.1)
    case, front, pull, sign = paint(color), paint(color), paint(color), paint(color)
    box(body, (-x, -y, 0), (x, y, z), case, WOOD)
    out, half, bars = shape.uniform(0.02, 0.03), shape.uniform(0.3, 0.45) * y, bool(shape.random() < 0.6)
    high, detail = shape.uniform(-0.15, 0.15) * z, int(shape.integers(3))
    width, tall = shape.uniform(0.75, 0.9) * y, shape.uniform(0.3, 0.42) * z
    for k, face in enumerate(_faces(body, x, y, z, turns)):
        leaf, name = face, "drawer"
        if k == 0:
            leaf = inner(face, name, np.eye(3), (0, 0, 0))
            slide(leaf, name, (0, 0, 1), 0.1)
        box(leaf, (-tall, -width, -0.01 if k else -0.8 * x), (tall, width, 0.004), front, WOOD)
        if bars or k == 0:
            for end in (-half, half):
                capsule(leaf, (high, end, 0), (high, end, out), 0.004, pull, METAL)
            capsule(leaf, (high, -half, out), (high, half, out), 0.005, pull, METAL)
        if k == 0 and (bars or shape.random() < 0.5):
            _detail(leaf, detail, (0.6 * tall, 0.55 * width), sign)
    T = se3.make(np.diag([-1.0, 1.0, -1.0]) @ se3.euler(z=np.pi / 2), (high, 0, out))
    moving = (Moving("drawer", (0.0, shape.uniform(0.05, 0.08)), Hold(T, "drawer", 0.01)),)
    return Thing(spec, moving=moving, sided=True)


def _detail(face: Any, style: int, at: tuple[float, float], color: Color) -> None:
    """A keyhole, a label or a small lamp on a side; z outwards."""
    x, y = at
    if style == 0:
        spot = inner(face, "keyhole", np.eye(3), (x, y, 0))
        cylinder(spot, 0.006, 0, 0.006, color, METAL)
        box(spot, (0, -0.002, 0), (0.013, 0.002, 0.006), color, METAL)
    elif style == 1:
        box(face, (x - 0.006, y - 0.016, 0), (x + 0.006, y + 0.016, 0.005), color, PLASTIC)
    else:
        spot = inner(face, "lamp", np.eye(3), (x, y, 0))
        cylinder(spot, 0.008, 0, 0.012, color, PLASTIC)


def capped(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A bar or a board alike at both ends but for a coloured end, a notch or a loop, where it is taken."""
    spec, body = part(fixed=True)
    x, y, z = shape.uniform(0.045, 0.09), shape.uniform(0.01, 0.03), shape.uniform(0.02, 0.035)
    first, second = paint(color), paint(color)
    style, cap = shape.random(), shape.uniform(0.08, 0.2) * 2 * x
    at, width = x - cap / 2, 2 * y
    if style < 0.5:
        box(body, (-x, -y, 0), (x - cap, y, z), first, WOOD)
        box(body, (x - cap, -y, 0), (x, y, z), second, WOOD)
    elif style < 0.75:
        box(body, (-x, -y, 0), (x, y, z), first, WOOD)
        box(body, (x - cap, -0.6 * y, z), (x - 0.3 * cap, 0.6 * y, z + 0.004), second, PLASTIC)
    else:
        for side in (-1.0, 1.0):
            end = inner(body, "end" if side > 0 else "start", np.eye(3), (side * x, 0, 0))
            cylinder(end, 1.3 * y, 0, z, first if side < 0 else second, WOOD)
        box(body, (-x, -0.6 * y, 0), (x, 0.6 * y, z), first, WOOD)
        at, width = x, 2.6 * y
    grips = [Hold(from_above((at, 0, max(0.0095, z - 0.02))), width=width)]
    if style < 0.75:
        tip = from_side((x - 0.012, 0, max(0.014, z / 2)), down=shape.uniform(0.7, 1.2))
        grips.append(Hold(tip, width=width))
    pokes = (Hold(from_above((at, 0, z + 0.004 * (0.5 <= style < 0.75))), width=0.0),)
    return Thing(spec, tuple(grips), pokes=pokes, spots=(up(at, 0, z),), sided=True)


def drum(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A tin, a prism or a box that has one ear, one tap or one button on one of its equal sides."""
    spec, body = part(fixed=True)
    r, z = shape.uniform(0.03, 0.06), shape.uniform(0.05, 0.13)
    sides = int(shape.choice((4, 6, 8, 20)))
    first, second = paint(color), paint(color)
    mantle = inner(body, "mantle", se3.euler(z=np.pi / sides), (0, 0, 0))
    lathe.solid(spec, mantle, "mantle", [(r, 0.0), (r, z)], first, PLASTIC, sides)
    flat, high = r * np.cos(np.pi / sides), shape.uniform(0.5, 0.85) * z
    style = shape.random()
    rim = shape.uniform(0.004, 0.008)
    lid = inner(body, "lid", se3.euler(z=np.pi / sides), (0, 0, z))
    lathe.solid(spec, lid, "lid", [(0.95 * r, 0.0), (0.9 * r, rim)], paint(color), PLASTIC, sides)
    if style < 0.4:
        out, bar = flat + shape.uniform(0.022, 0.032), 0.005
        for a, b in (
            ((flat, 0, high), (out, 0, high)),
            ((out, 0, high), (out, 0, 0.4 * high)),
            ((out, 0, 0.4 * high), (flat, 0, 0.4 * high)),
        ):
            capsule(body, a, b, bar, second, PLASTIC)
        hold = Hold(from_side((out, 0, 0.7 * high), down=shape.uniform(0.3, 0.9)), width=2 * bar)
        return Thing(spec, (hold,), spots=(up(0.5 * flat, 0, z + rim),), sided=True)
    if style < 0.7:
        out = flat + shape.uniform(0.012, 0.02)
        capsule(body, (flat, 0, high), (out, 0, high), shape.uniform(0.006, 0.01), second, PLASTIC)
        poke = Hold(from_side((out + 0.006, 0, high), down=shape.uniform(0.2, 0.8)), width=0.0)
        return Thing(spec, pokes=(poke,), sided=True)
    knob = 0.007
    capsule(body, (0.65 * flat, 0, z), (0.65 * flat, 0, z + rim + 0.018), knob, second, PLASTIC)
    grip = Hold(from_above((0.65 * flat, 0, z + rim + 0.016)), width=2 * knob)
    return Thing(
        spec, (grip,), pokes=(Hold(from_above((0.65 * flat, 0, z + rim + 0.025)), width=0.0),), sided=True
    )


def casket(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A closed box whose two or four sides are framed alike; a tab on one of them is pulled or pressed."""
    spec, body = part(fixed=True)
    turns = int(shape.choice((2, 4)))
    x, z, w = shape.uniform(0.04, 0.08), shape.uniform(0.05, 0.09), 0.006
    y = x if turns == 4 else shape.uniform(0.04, 0.08)
    first, frame, tab = paint(color), paint(color), paint(color)
    box(body, (-x, -y, 0), (x, y, z), first, WOOD)
    for face in _faces(body, x, y, z, turns):
        for side in (-1.0, 1.0):
            a, b = sorted((side * 0.45 * z, side * (0.45 * z - w)))
            box(face, (a, -0.85 * y, 0), (b, 0.85 * y, 0.003), frame, WOOD)
            a, b = sorted((side * 0.85 * y, side * (0.85 * y - w)))
            box(face, (w - 0.45 * z, a, 0), (0.45 * z - w, b, 0.003), frame, WOOD)
    out, half, at = shape.uniform(0.015, 0.03), shape.uniform(0.008, 0.02), shape.uniform(-0.4, 0.4) * y
    high = shape.uniform(0.6, 0.95) * z
    box(body, (x, at - half, high - 0.008), (x + out, at + half, high), tab, PLASTIC)
    grips = (Hold(from_front((x + 0.7 * out, at, high - 0.004), shape.uniform(0.2, 0.8)), width=0.008),)
    pokes = (Hold(from_above((x + 0.6 * out, at, high)), width=0.0),)
    return Thing(spec, grips, pokes, spots=(up(0.7 * x, at, z),), sided=True)


def painted(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """Something round, or of equal sides; paint alone tells its turn: a stripe, pointer, spot or label."""
    spec, body = part()
    r, z, sides = shape.uniform(0.018, 0.038), shape.uniform(0.012, 0.08), int(shape.choice((4, 8, 20)))
    first, second = paint(color), paint(color)
    mantle = inner(body, "mantle", se3.euler(z=np.pi / sides), (0, 0, 0))
    lathe.solid(spec, mantle, "mantle", [(r, 0.0), (r, z)], first, PLASTIC, sides)
    flat, style, top = r * np.cos(np.pi / sides), int(shape.integers(4)), z + 0.0005
    thin = shape.uniform(0.1, 0.25) * flat
    if style < 2:
        box(
            body,
            (-0.9 * flat if style == 0 else 0.0, -thin, z - 0.004),
            (0.9 * flat, thin, top),
            second,
            WOOD,
        )
    elif style == 2:
        spot = inner(body, "spot", np.eye(3), (0.6 * flat, 0, 0))
        cylinder(spot, 0.35 * flat, z - 0.004, top, second, WOOD)
    else:
        box(body, (0.7 * flat, -0.4 * flat, 0.2 * z), (flat + 0.0005, 0.4 * flat, 0.8 * z), second, WOOD)
    grip = from_above((0, 0, max(0.0095, z - 0.02)), yaw=float(shape.choice((0.0, np.pi / 2))))
    poke = Hold(from_above((0.0 if style == 0 else 0.7 * flat, 0, z)), width=0.0)
    turns = np.stack([se3.make(se3.euler(z=angle)) for angle in (0.0, np.pi)[: 2 if style == 0 else 1]])
    return Thing(
        spec, (Hold(grip, width=2 * flat),), (poke,), (up(0, 0, z),), symmetry=turns, sided=style > 0
    )
