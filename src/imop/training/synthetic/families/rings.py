"""Rings and pegs, hooks and stands."""

import numpy as np

from imop.geometry import se3
from imop.sim.parts import lathe
from imop.sim.parts.shapes import METAL, PLASTIC, WOOD, box, capsule, cylinder, part
from imop.training.synthetic.families.thing import Hold, Thing, from_above, from_side, paint, revolution, up


def ring(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A flat ring, with or without a grip towards +x; frame: centre of its underside."""
    hole, width, h = shape.uniform(0.015, 0.04), shape.uniform(0.008, 0.022), shape.uniform(0.01, 0.026)
    outer = hole + width
    spec, body = part(fixed=True)
    first = paint(color)
    lathe.shell(spec, body, "ring", [(outer, 0.0), (outer, h)], width, first, PLASTIC, 20)
    if shape.random() < 0.4:
        hold = Hold(from_above((0, outer - width / 2, 0.5 * h)), width=width)
        return Thing(spec, (hold,), symmetry=revolution())
    length, half, top = shape.uniform(0.03, 0.06), shape.uniform(0.004, 0.009), shape.uniform(0.012, 0.03)
    second = paint(color)
    box(body, (outer - 0.003, -half, 0), (outer + length, half, top), second, PLASTIC)
    hold = Hold(from_above((outer + 0.6 * length, 0, 0.6 * top)), width=2 * half)
    return Thing(spec, (hold,))


def peg(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """One to three pegs on a plate; frame: centre of its base."""
    count = int(shape.choice((1, 1, 1, 2, 3)))
    pitch, side = shape.uniform(0.06, 0.1), shape.uniform(0.025, 0.05)
    spec, body = part(fixed=True)
    plate = paint(color)
    long = side + (count - 1) * pitch / 2
    box(body, (-long, -side, 0), (long + shape.uniform(0, 0.03), side, 0.012), plate, WOOD)
    spots = []
    for k in range(count):
        x = (k - (count - 1) / 2) * pitch
        radius, height = shape.uniform(0.006, 0.013), shape.uniform(0.05, 0.13)
        rod = paint(color)
        capsule(body, (x, 0, 0.01), (x, 0, height - radius), radius, rod, PLASTIC)
        spots += [up(x, 0, 0.012), up(x, 0, height)]
    return Thing(spec, spots=tuple(spots))


def stand(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A post with one to three hooks; frame: centre of its base."""
    spec, body = part(fixed=True)
    x, y, h = shape.uniform(0.04, 0.07), shape.uniform(0.04, 0.07), shape.uniform(0.12, 0.24)
    base, post = paint(color), paint(color)
    if shape.random() < 0.5:
        box(body, (-x, -y, 0), (x, y, 0.012), base, WOOD)
    else:
        cylinder(body, x, 0, 0.012, base, WOOD)
    cylinder(body, shape.uniform(0.006, 0.012), 0.012, h, post, WOOD)
    hooks = post if shape.random() < 0.5 else paint(color)
    spots = []
    for k in range(int(shape.integers(1, 4))):
        at, yaw = h - shape.uniform(0.005, 0.02) - 0.045 * k, k * np.pi * shape.choice((0.5, 1.0))
        rise, length = np.radians(shape.uniform(5, 40)), shape.uniform(0.05, 0.09)
        way = se3.euler(z=yaw) @ (np.cos(rise), 0.0, np.sin(rise))
        start = np.array((0, 0, at))
        capsule(body, start.tolist(), (start + length * way).tolist(), 0.004, hooks, METAL)
        axis = se3.euler(z=yaw) @ se3.euler(y=np.pi / 2 - rise)
        spots.append(se3.make(axis, start + 0.6 * length * way))
    return Thing(spec, spots=tuple(spots))


def stacker(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A turned piece: a spool, a chess man, a spinning top; frame: centre of its base."""
    spec, body = part(fixed=True)
    z, first, second = 0.0, paint(color), paint(color)
    count = int(shape.integers(2, 5))
    radii = shape.uniform(0.01, 0.036, count + 1)
    for k in range(count):
        h = shape.uniform(0.012, 0.035)
        name = f"piece{k}"
        piece = [(radii[k], z), (radii[k + 1] if shape.random() < 0.6 else radii[k], z + h)]
        lathe.solid(spec, body, name, piece, first if k % 2 else second, PLASTIC, 16)
        z += h
    width = 2 * float(radii[-2:].max())
    grips = (
        Hold(from_above((0, 0, z - 0.012)), width=width),
        Hold(from_side((0, 0, z - 0.015), down=0.5), width=width),
    )
    return Thing(spec, grips, spots=(up(z=z),), symmetry=revolution())
