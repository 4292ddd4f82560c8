"""Vessels with a spout: kettles and teapots, jugs and watering cans; frame: centre of the base."""

from itertools import pairwise

import numpy as np

from imop.geometry import se3
from imop.sim.parts import lathe
from imop.sim.parts.shapes import PLASTIC, capsule, cylinder, part
from imop.training.synthetic.families.fittings import ball, rod
from imop.training.synthetic.families.thing import Hold, Thing, from_above, from_side, paint, up


def kettle(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A kettle with a bow over its lid, or a teapot with an ear behind; its spout points to +x."""
    r, h = shape.uniform(0.035, 0.06), shape.uniform(0.05, 0.09)
    top, bulge = r * shape.uniform(0.4, 0.75), r * shape.uniform(1.0, 1.25)
    spec, body = part(fixed=True)
    first = paint(color)
    second = first if shape.random() < 0.3 else paint(color)
    lathe.solid(spec, body, "belly", [(r, 0.0), (bulge, 0.4 * h), (top, h)], first, PLASTIC, 16)
    cylinder(body, 0.9 * top, h, h + 0.006, second, PLASTIC)
    knob = shape.uniform(0.006, 0.01)
    ball(body, (0, 0, h + 0.006 + 0.7 * knob), (knob, knob, knob), second)
    thin, out = shape.uniform(0.004, 0.008), shape.uniform(0.025, 0.05)
    low, high = shape.uniform(0.25, 0.5) * h, shape.uniform(0.75, 1.05) * h
    tip = (bulge + out, 0.0, high)
    capsule(body, (0.8 * bulge, 0, low), (bulge + 0.5 * out, 0, (low + high) / 2), 1.5 * thin, first, PLASTIC)
    capsule(body, (bulge + 0.5 * out, 0, (low + high) / 2), tip, thin, first, PLASTIC)
    bar = shape.uniform(0.004, 0.006)
    if shape.random() < 0.5:
        over, half = h + shape.uniform(0.035, 0.05), 0.75 * bulge
        bow = [(-half, 0, 0.7 * h), (-0.6 * half, 0, over), (0.6 * half, 0, over), (half, 0, 0.7 * h)]
        grips: tuple[Hold, ...] = (
            Hold(from_above((0, 0, over)), width=2 * bar),
            Hold(from_above((-0.4 * half, 0, over)), width=2 * bar),
        )
    else:
        back = -bulge - shape.uniform(0.022, 0.04)
        bow = [(-top, 0, 0.92 * h), (back, 0, 0.85 * h), (back, 0, 0.35 * h), (-0.95 * bulge, 0, 0.3 * h)]
        ear = se3.make(se3.euler(z=np.pi)) @ from_side((-back, 0, 0.6 * h), down=shape.uniform(0.3, 0.9))
        grips = (
            Hold(ear, width=2 * bar),
            Hold(from_above((back, 0, 0.85 * h)), width=2 * bar),
            Hold(from_above((0, 0, h + 0.006 + knob)), width=2 * knob),
        )
    for a, b in pairwise(bow):
        capsule(body, a, b, bar, second, PLASTIC)
    return Thing(spec, grips, spots=(up(z=h),), tool=se3.make(se3.euler(y=np.pi / 3), tip))


def jug(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A jug with a lip, or a watering can with a long spout and a rose; its spout points to +x."""
    r, h, wall = shape.uniform(0.03, 0.05), shape.uniform(0.07, 0.13), 0.004
    low = r * shape.uniform(0.75, 1.1)
    spec, body = part(fixed=True)
    first = paint(color)
    second = first if shape.random() < 0.4 else paint(color)
    cylinder(body, low, 0, wall, first, PLASTIC)
    middle = (shape.uniform(0.95, 1.25) * max(r, low), 0.4 * h)
    lathe.shell(spec, body, "wall", [(low, wall), middle, (r, h)], wall, first, PLASTIC, 16)
    if shape.random() < 0.5:
        tip = (r + shape.uniform(0.035, 0.06), 0.0, h * shape.uniform(0.9, 1.15))
        rod(body, (0.9 * middle[0], 0, 0.3 * h), tip, shape.uniform(0.004, 0.008), first)
        way = np.array((tip[0] - 0.9 * middle[0], 0, tip[2] - 0.3 * h))
        rose = np.array(tip) + 0.012 * way / np.linalg.norm(way)
        rod(body, tip, rose.tolist(), shape.uniform(0.01, 0.018), second)
    else:
        tip = (r + 0.018, 0.0, h + 0.003)
        for side in (-1, 1):
            capsule(body, (0.85 * r, side * 0.4 * r, h - 0.006), tip, 0.004, first, PLASTIC)
        capsule(body, (r, 0, h - 0.02), tip, 0.004, first, PLASTIC)
    back, bar = -r - shape.uniform(0.025, 0.04), shape.uniform(0.004, 0.006)
    top, bottom = shape.uniform(0.8, 0.95) * h, shape.uniform(0.2, 0.4) * h
    bow = [(-r + wall / 2, 0, top), (back, 0, top), (back, 0, bottom), (-0.97 * low, 0, bottom)]
    for a, b in pairwise(bow):
        capsule(body, a, b, bar, second, PLASTIC)
    turned = se3.make(se3.euler(z=np.pi))
    middle_bar = (-back, 0.0, (top + bottom) / 2)
    grips = (
        Hold(turned @ from_side(middle_bar, down=shape.uniform(0.2, 0.9)), width=2 * bar),
        Hold(from_above((back, 0, top)), width=2 * bar),
        Hold(from_above((0, r - wall / 2, h - 0.012)), width=wall),
    )
    tool = se3.make(se3.euler(y=np.pi / 3), tip)
    return Thing(spec, grips, spots=(up(z=wall),), tool=tool)
