"""Thin shells that swing: tilting panels, easels, hatches that open downward, letterboxes, grilles."""

from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.parts.shapes import METAL, PLASTIC, WOOD, Color, box, capsule, cylinder, part
from imop.training.synthetic.families.cabinets import open_box
from imop.training.synthetic.families.fittings import ball, inner, link, rod, slanted
from imop.training.synthetic.families.levers import both_ways
from imop.training.synthetic.families.solids import QUARTER_TURNS
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


def solar(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A panel with cells that tilts on a post; frame: centre of the base."""
    h, x, y = shape.uniform(0.1, 0.17), shape.uniform(0.05, 0.09), shape.uniform(0.06, 0.13)
    spec, body = part(fixed=True)
    box(body, (-0.05, -0.05, 0), (0.05, 0.05, 0.012), paint(color), WOOD)
    rod(body, (0, 0, 0.012), (0, 0, h), shape.uniform(0.006, 0.012), paint(color))
    sheet = link(body, "panel", (0, 0, h + 0.004), (0, 1, 0), (-1.2, 1.2))
    t, cells = shape.uniform(0.002, 0.005), int(shape.integers(1, 4))
    box(sheet, (-x, -y, 0), (x, y, 2 * t), paint(color), PLASTIC)
    face, pitch = paint(color), 1.8 * y / cells
    for k in range(cells):
        low = -0.9 * y + k * pitch
        box(sheet, (-0.85 * x, low + 0.003, 0), (0.7 * x, low + pitch - 0.003, 2 * t + 0.0007), face, 80)
    at = shape.uniform(-0.6, 0.6) * y
    edge = Hold(from_front((x - 0.012, at, t), shape.uniform(0.3, 0.6)), "panel", 2 * t)
    low, high = shape.uniform(-0.5, -0.1), shape.uniform(0.3, 0.5)
    press = Hold(from_above((0.8 * x, at, 2 * t)), "panel", 0.0)
    moving = (*both_ways("panel", low, high, edge), Moving("panel", (low, high), press, push=True))
    return Thing(spec, moving=moving, symmetry=QUARTER_TURNS)


def easel(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """An easel or a music stand: a thin board over a ledge, to tip back; frame: centre of its base."""
    h, y, z = shape.uniform(0.03, 0.13), shape.uniform(0.05, 0.11), shape.uniform(0.08, 0.14)
    spec, body = part(fixed=True)
    legs, ledge = paint(color), paint(color)
    if shape.random() < 0.5:
        for side in (-1, 1):
            capsule(body, (0.04, side * 0.8 * y, 0.005), (0, side * 0.5 * y, h), 0.005, legs, METAL)
        capsule(body, (-0.07, 0, 0.005), (0, 0, h), 0.005, legs, METAL)
    else:
        rod(body, (0, 0, 0), (0, 0, h), 0.008, legs)
        rod(body, (0, 0, 0), (0, 0, 0.01), 0.055, legs)
    box(body, (-0.01, -0.7 * y, h), (0.03, 0.7 * y, h + 0.006), ledge, WOOD)
    sheet = link(body, "board", (0, 0, h + 0.008), (0, -1, 0), (-0.2, 1.2))
    t = shape.uniform(0.0015, 0.004)
    box(sheet, (-t, -y, 0), (t, y, z), paint(color), WOOD)
    low, wide = shape.uniform(0.1, 0.5), shape.uniform(0.3, 0.7)
    box(sheet, (0, -wide * y, low * z), (t + 0.0006, 0.7 * y, (low + 0.4) * z), paint(color), 80)
    at = shape.uniform(-0.7, 0.7) * y
    press = Hold(from_side((t, at, 0.85 * z), down=shape.uniform(0.2, 0.7)), "board", 0.0)
    # The board is held by a tab on its upper edge.
    box(sheet, (-0.002, at - 0.006, z), (0.002, at + 0.006, z + 0.02), paint(color), PLASTIC)
    tab = Hold(from_side((0, at, z + 0.012), down=shape.uniform(0.4, 0.9)), "board", 0.012)
    back = shape.uniform(0.5, 0.9)
    moving = (Moving("board", (0.05, back), press, push=True), *both_ways("board", 0.05, back, tab))
    return Thing(spec, spots=(up(0.016, 0, h + 0.006),), moving=moving)


def hatch(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """An oven flap or a drawbridge: it opens downward, by a fin; frame: centre of the base."""
    x, y, z = shape.uniform(0.04, 0.08), shape.uniform(0.06, 0.11), shape.uniform(0.1, 0.16)
    spec, body = part(fixed=True)
    low, wall, t = shape.uniform(0.03, 0.05), shape.uniform(0.008, 0.02), shape.uniform(0.002, 0.005)
    shell, sheet_color = paint(color), paint(color)
    bridge = bool(shape.random() < 0.45)
    if bridge:
        _towers(shape, color, body, (x, y, z))
        box(body, (-x, -y, 0), (x, y, low), shell, WOOD)
    else:
        box(body, (-x, -y, 0), (x, y, low - 0.002), shell, WOOD)
        oven = inner(body, "oven", np.eye(3), (0, 0, low - 0.002))
        open_box(oven, x, y, z - low, wall, shell)
        for k in range(int(shape.integers(0, 4))):
            ball(body, (x, (0.3 + 0.2 * k) * y, low / 2), (0.008, 0.006, 0.006), sheet_color)
    half, long = y * shape.uniform(0.7, 0.95), z - low - 0.004
    sheet = link(body, "flap", (x + 0.001, 0, low), (0, 1, 0), (0.0, 1.5))
    box(sheet, (0, -half, 0), (2 * t, half, long), sheet_color, WOOD)
    if shape.random() < 0.5:
        box(sheet, (t, -0.7 * half, 0.2 * long), (2 * t + 0.0006, 0.7 * half, 0.7 * long), paint(color), 80)
    at, w, out = shape.uniform(-0.5, 0.5) * half, shape.uniform(0.004, 0.009), shape.uniform(0.02, 0.03)
    box(sheet, (2 * t, at - w, long - 0.025), (2 * t + out, at + w, long), paint(color), PLASTIC)
    fin = Hold(from_above((2 * t + 0.6 * out, at, long - 0.008)), "flap", 2 * w)
    return Thing(spec, spots=(up(z=z),), moving=both_ways("flap", 0.0, shape.uniform(0.7, 1.3), fin))


def _towers(
    shape: np.random.Generator, color: np.random.Generator, body: Any, size: tuple[float, float, float]
) -> None:
    """Two towers beside a gate; a roof on one of them."""
    x, y, z = size
    stone, wide = paint(color), shape.uniform(0.015, 0.03)
    for side in (-1.0, 1.0):
        a, b = sorted((side * y, side * (y + 2 * wide)))
        box(body, (-x, a, 0), (x, b, z), stone, WOOD)
    side = float(shape.choice((-1.0, 1.0)))
    top = inner(body, "top", np.eye(3), (0, side * (y + wide), 0))
    cylinder(top, 0.8 * wide, z, z + shape.uniform(0.01, 0.03), paint(color), PLASTIC)
    a, b = (0.6 * z, z) if shape.random() < 0.5 else (0.85 * z, z)
    box(body, (-x, -y, a), (-0.6 * x, y, b), stone, WOOD)


def letterbox(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A letterbox or a cat flap: its flap hangs from its upper edge; frame: centre of the base."""
    y, z, t = shape.uniform(0.05, 0.1), shape.uniform(0.13, 0.2), shape.uniform(0.0015, 0.004)
    spec, body = part(fixed=True)
    shell, mark = paint(color), paint(color)
    cat = bool(shape.random() < 0.5)
    low, high = shape.uniform(0.03, 0.06), z - shape.uniform(0.02, 0.04)
    half, x = y * shape.uniform(0.6, 0.8), 0.008 if cat else shape.uniform(0.04, 0.07)
    if cat:
        _frame(body, (x, y, z), (half, low, high), shell)
        box(body, (-0.05, -y, 0), (0.05, y, 0.008), shell, WOOD)
        side = float(shape.choice((-1.0, 1.0)))
        a, b = sorted((side * (half + 0.003), side * y))
        box(body, (x, a, 0.6 * z), (x + 0.006, b, 0.85 * z), mark, PLASTIC)
    else:
        box(body, (-x, -y, 0), (x, y, z), shell, WOOD)
        rod(body, (-x, 0, z), (x, 0, z), y, shell)
        side = float(shape.choice((-1.0, 1.0)))
        capsule(
            body, (0, side * (y + 0.004), z - 0.02), (0, side * (y + 0.004), z + 0.04), 0.003, mark, METAL
        )
        a, b = sorted((side * (y + 0.002), side * (y + 0.005)))
        box(body, (0, a, z + 0.015), (0.035, b, z + 0.04), mark, PLASTIC)
    out = 0.0 if cat else x + 0.002
    sheet = link(body, "flap", (out, 0, high), (0, -1, 0), (-1.3, 1.3))
    sheet_color, long = paint(color), high - low
    box(sheet, (0, 0.003 - half, -long), (2 * t, half - 0.003, 0), sheet_color, PLASTIC)
    at, w = shape.uniform(-0.5, 0.5) * half, shape.uniform(0.005, 0.01)
    box(sheet, (2 * t, at - w, -long), (2 * t + 0.022, at + w, 0.02 - long), paint(color), PLASTIC)
    tab = Hold(from_side((2 * t + 0.012, at, 0.01 - long), down=shape.uniform(0.1, 0.5)), "flap", 2 * w)
    moving = list(both_ways("flap", 0.0, shape.uniform(0.5, 1.1), tab))
    if cat:
        press = Hold(from_side((2 * t, -at, 0.02 - long), down=shape.uniform(0.6, 0.9)), "flap", 0.0)
        moving.append(Moving("flap", (0.0, -shape.uniform(0.4, 0.7)), press, push=True))
    return Thing(spec, moving=tuple(moving))


def _frame(
    body: Any, size: tuple[float, float, float], hole: tuple[float, float, float], color: Color
) -> None:
    """A wall of half sizes x and y and height z with a hole of half width, from a height to another."""
    (x, y, z), (half, low, high) = size, hole
    box(body, (-x, -y, 0), (x, y, low), color, WOOD)
    box(body, (-x, -y, high), (x, y, z), color, WOOD)
    box(body, (-x, -y, low), (x, -half, high), color, WOOD)
    box(body, (-x, half, low), (x, y, high), color, WOOD)


def grille(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A vent: a grille of slats on a hinge at one side of a frame; frame: centre of the base."""
    y, z, side = shape.uniform(0.06, 0.1), shape.uniform(0.11, 0.18), float(shape.choice((-1.0, 1.0)))
    spec, body = part(fixed=True)
    shell, low, t = paint(color), shape.uniform(0.015, 0.03), 0.003
    box(body, (-0.05, -y, 0), (0.02, y, 0.01), shell, WOOD)
    half = y - shape.uniform(0.012, 0.025)
    _frame(body, (0.012, y, z + 0.02), (half, low, z), shell)
    box(body, (-0.014, -y, 0), (-0.012, y, z + 0.02), paint(color), WOOD)
    sheet = link(body, "grille", (0.014, -side * half, 0), (0, 0, -side), (0.0, 2.0))
    bars, wide = paint(color), 2 * half - 0.004
    for a, b in ((0.0, 0.01), (wide - 0.01, wide)):
        c, d = sorted((side * a, side * b))
        box(sheet, (0, c, low), (2 * t, d, z), bars, METAL)
    count = int(shape.integers(4, 9))
    R = se3.euler(y=shape.uniform(-0.8, 0.8))
    for high in np.linspace(low + 0.006, z - 0.006, count):
        slanted(sheet, (t, side * wide / 2, float(high)), (t, wide / 2, 0.004), R, bars)
    at, high, w = side * (wide - 0.006), shape.uniform(0.4, 0.75) * z, 0.006
    box(sheet, (2 * t, at - w, high - 0.015), (2 * t + 0.025, at + w, high + 0.015), paint(color), PLASTIC)
    hold = Hold(from_side((2 * t + 0.015, at, high), down=shape.uniform(0, 0.5)), "grille", 2 * w)
    return Thing(spec, moving=both_ways("grille", 0.0, shape.uniform(0.7, 1.7), hold))
