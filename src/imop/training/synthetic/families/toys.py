"""Toys that are small forms of large things: furniture, cars, planes, and shoes."""

import numpy as np

from imop.geometry import se3
from imop.sim.parts.shapes import PLASTIC, WOOD, box, part
from imop.training.synthetic.families.fittings import AHEAD, ball, rod, slanted
from imop.training.synthetic.families.solids import HALF_TURN
from imop.training.synthetic.families.thing import Hold, Thing, from_above, paint, up


def furniture(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A doll's stool, table or chair; frame: centre of its base."""
    x, y, h = shape.uniform(0.025, 0.055), shape.uniform(0.025, 0.036), shape.uniform(0.04, 0.09)
    leg, t = shape.uniform(0.003, 0.006), shape.uniform(0.004, 0.01)
    spec, body = part(fixed=True)
    legs, seat = paint(color), paint(color)
    for i in (-1, 1):
        for j in (-1, 1):
            a, b = i * (x - leg), j * (y - leg)
            box(body, (a - leg, b - leg, 0), (a + leg, b + leg, h), legs, WOOD)
    box(body, (-x, -y, h), (x, y, h + t), seat, WOOD)
    across = Hold(from_above((shape.uniform(-0.3, 0.3) * x, 0, h)), width=2 * y)
    if shape.random() < 0.35:
        return Thing(spec, (across,), spots=(up(z=h + t),), symmetry=HALF_TURN)
    back = shape.uniform(0.04, 0.08)
    box(body, (-x, -y, h + t), (-x + 2 * leg, y, h + t + back), legs, WOOD)
    if shape.random() < 0.4:
        for j in (-1, 1):
            arm, high = j * (y - leg), h + t + 0.4 * back
            rod(body, (-x, arm, high), (0.6 * x, arm, high), leg, seat)
    rim = Hold(from_above((-x + leg, 0, h + t + back - 0.012), np.pi / 2), width=2 * leg)
    return Thing(spec, (rim,), spots=(up(0.2 * x, 0, h + t),))


def car(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A toy car, lorry or tractor that heads for +x; frame: centre of its base."""
    x, y, r = shape.uniform(0.035, 0.07), shape.uniform(0.015, 0.03), shape.uniform(0.009, 0.016)
    spec, body = part(fixed=True)
    low, high = 0.6 * r, shape.uniform(0.6, 1.4) * r + 0.01
    first, tyre, glass = paint(color), paint(color), paint(color)
    box(body, (-x, -y, low), (x, y, low + high), first, PLASTIC)
    for i in (-0.6, 0.6):
        rod(body, (i * x, -y - 0.005, r), (i * x, y + 0.005, r), r, tyre)
    start, long, tall = shape.uniform(-0.9, -0.2) * x, shape.uniform(0.5, 0.9) * x, shape.uniform(0.012, 0.03)
    top = low + high
    box(body, (start, -0.9 * y, top), (start + long, 0.9 * y, top + tall), paint(color), PLASTIC)
    front, low_pane, high_pane = start + long, top + 0.3 * tall, top + 0.8 * tall
    box(body, (front - 0.001, -0.7 * y, low_pane), (front + 0.001, 0.7 * y, high_pane), glass, 80)
    for side in (-0.6, 0.6):
        ball(body, (x, side * y, low + 0.6 * high), (0.004, 0.005, 0.005), glass)
    grips = [Hold(from_above((start + long / 2, 0, top + tall - 0.01)), width=1.8 * y)]
    if start + long < 0.5 * x:
        grips.append(Hold(from_above((0.75 * x, 0, top - 0.008)), width=2 * y))
    return Thing(spec, tuple(grips), spots=(up(start + long / 2, 0, top + tall),))


def plane(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A toy plane or a fish: a body with wings and a tail; it heads for +x; frame: under its middle."""
    x, r = shape.uniform(0.05, 0.09), shape.uniform(0.01, 0.018)
    span, chord, t = shape.uniform(0.05, 0.1), shape.uniform(0.012, 0.025), shape.uniform(0.0015, 0.003)
    spec, body = part(fixed=True)
    first, wing = paint(color), paint(color)
    ball(body, (0, 0, r), (x, r, r), first)
    at, z, sweep = shape.uniform(-0.1, 0.3) * x, shape.uniform(0.6, 1.6) * r, shape.uniform(-0.1, 0.5)
    for side in (-1, 1):
        R = se3.euler(z=side * sweep)
        center = np.array((at, 0, z)) + R @ (0, side * span / 2, 0)
        slanted(body, center, (chord, span / 2, t), R, wing)
    box(body, (-x, -0.35 * span, r), (-x + 0.02, 0.35 * span, r + 2 * t), wing, PLASTIC)
    box(body, (-x, -t, r), (-x + 0.022, t, r + shape.uniform(0.025, 0.045)), paint(color), PLASTIC)
    grips = (Hold(from_above((at - 0.3 * x, 0, r)), width=2 * r),)
    return Thing(spec, grips, tool=se3.make(AHEAD, (x, 0, r)))


def shoe(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A left or a right shoe, toe at +x; frame: middle of the sole."""
    x, y, h = shape.uniform(0.05, 0.08), shape.uniform(0.018, 0.026), shape.uniform(0.03, 0.055)
    side = float(shape.choice((-1.0, 1.0)))
    spec, body = part(fixed=True)
    sole, upper = paint(color), paint(color)
    box(body, (-x, -y, 0), (0.4 * x, y, 0.008), sole, PLASTIC)
    # The toe cap points inwards: so left and right differ.
    R = se3.euler(z=side * shape.uniform(0.15, 0.35))
    slanted(body, np.array((0.4 * x, 0, 0.004)) + R @ (0.3 * x, 0, 0), (0.35 * x, 0.9 * y, 0.004), R, sole)
    ball(body, np.array((0.3 * x, 0, 0.008)) + R @ (0.25 * x, 0, 0), (0.45 * x, 0.95 * y, 0.6 * h), upper)
    w = 0.004
    box(body, (-x, -y, 0.008), (w - x, y, h), upper, PLASTIC)
    for j in (-1, 1):
        a, b = sorted((j * y, j * (y - w)))
        box(body, (w - x, a, 0.008), (0.2 * x, b, 0.85 * h), upper, PLASTIC)
    ball(body, (0.3 * x, 0, 0.5 * h), (0.012, 0.6 * y, 0.3 * h), paint(color))
    grips = (
        Hold(from_above((w / 2 - x, 0, h - 0.012), np.pi / 2), width=w),
        Hold(from_above((-0.4 * x, 0, 0.85 * h - 0.01)), width=2 * y),
    )
    return Thing(spec, grips, spots=(up(-0.4 * x, 0, 0.008),))
