"""Cans, bottles, mugs, bowls, plates."""

import numpy as np

from imop.geometry import se3
from imop.sim.parts import lathe
from imop.sim.parts.shapes import PLASTIC, capsule, cylinder, part
from imop.training.synthetic.families.thing import Hold, Thing, from_above, from_side, paint, revolution, up

LYING = se3.euler(y=np.pi / 2)


def can(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A can with its rims and sometimes a band; frame: centre of its base."""
    r, h = shape.uniform(0.016, 0.038), shape.uniform(0.04, 0.14)
    spec, body = part(fixed=True)
    first, rim = paint(color), paint(color)
    cylinder(body, r, 0.004, h - 0.004, first, PLASTIC)
    if shape.random() < 0.5:
        cylinder(body, r + 0.001, 0, 0.005, rim, PLASTIC)
        cylinder(body, r + 0.001, h - 0.005, h, rim, PLASTIC)
    else:
        cylinder(body, r - 0.001, 0, h, first, PLASTIC)
    if shape.random() < 0.5:
        low = shape.uniform(0.2, 0.5) * h
        cylinder(body, r + 0.0007, low, low + shape.uniform(0.2, 0.4) * h, paint(color), PLASTIC)
    grips = (
        Hold(from_above((0, 0, h - min(0.02, h / 2))), width=2 * r),
        Hold(from_side((0, 0, 0.6 * h), down=shape.uniform(0, 0.6)), width=2 * r),
    )
    return Thing(spec, grips, spots=(up(z=h),), symmetry=revolution(), rests=(np.eye(3), LYING))


def bottle(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A turned bottle with a cap; frame: centre of its base."""
    r, h = shape.uniform(0.02, 0.038), shape.uniform(0.11, 0.24)
    neck, shoulder = shape.uniform(0.35, 0.6) * r, shape.uniform(0.45, 0.75) * h
    top = min(shoulder + shape.uniform(0.25, 0.6) * (h - shoulder), h - 0.014)
    spec, body = part(fixed=True)
    glass = paint(color)
    cylinder(body, r, 0, shoulder, glass, PLASTIC)
    lathe.solid(spec, body, "shoulder", [(r, shoulder), (neck, top)], glass, PLASTIC, 16)
    cylinder(body, neck, top, h - 0.012, glass, PLASTIC)
    cylinder(body, neck + shape.uniform(0.001, 0.005), h - 0.02, h, paint(color), PLASTIC)
    if shape.random() < 0.6:
        low = shape.uniform(0.15, 0.35) * h
        cylinder(body, r + 0.0007, low, 0.9 * shoulder, paint(color), PLASTIC)
    grips = (
        Hold(from_above((0, 0, h - 0.015)), width=2 * neck + 0.005),
        Hold(from_side((0, 0, 0.5 * shoulder), down=shape.uniform(0, 0.5)), width=2 * r),
    )
    return Thing(spec, grips, symmetry=revolution(), rests=(np.eye(3), LYING))


def mug(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A mug with its handle towards +x; frame: centre of its base."""
    r, h = shape.uniform(0.026, 0.042), shape.uniform(0.055, 0.11)
    low, wall = r * shape.uniform(0.7, 1.0), 0.004
    spec, body = part(fixed=True)
    first = paint(color)
    second = first if shape.random() < 0.6 else paint(color)
    cylinder(body, low, 0, wall, first, PLASTIC)
    lathe.shell(spec, body, "wall", [(low, wall), (r, h)], wall, first, PLASTIC, 16)
    reach, bar = shape.uniform(0.02, 0.034), shape.uniform(0.0035, 0.0055)
    top, bottom = shape.uniform(0.75, 0.88) * h, shape.uniform(0.15, 0.35) * h
    out = r + reach
    for a, b in (
        ((r - wall / 2, 0, top), (out, 0, top)),
        ((out, 0, top), (out, 0, bottom)),
        ((out, 0, bottom), (low, 0, bottom)),
    ):
        capsule(body, a, b, bar, second, PLASTIC)
    grips = (
        Hold(from_above((-r + wall / 2, 0, h - 0.015), np.pi / 2), width=wall),
        Hold(from_above((0, r - wall / 2, h - 0.015)), width=wall),
        Hold(from_side((out, 0, (top + bottom) / 2), down=shape.uniform(0.2, 0.9)), width=2 * bar),
        Hold(from_above((out, 0, top)), width=2 * bar),
    )
    loop = se3.make(se3.euler(x=np.pi / 2), (r + reach / 2, 0, top - 0.008))
    return Thing(spec, grips, spots=(up(z=wall),), mount=loop if shape.random() < 0.5 else None)


def bowl(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A bowl; frame: centre of its base."""
    r, h = shape.uniform(0.045, 0.085), shape.uniform(0.03, 0.06)
    low, wall = r * shape.uniform(0.4, 0.7), 0.004
    spec, body = part(fixed=True)
    first = paint(color)
    cylinder(body, low, 0, wall, first, PLASTIC)
    side = [(low, wall), ((low + 2 * r) / 3, 0.45 * h), (r, h)]
    lathe.shell(spec, body, "wall", side, wall, first, PLASTIC, 20)
    if shape.random() < 0.4:
        rim = [(r + 0.002, h - 0.006), (r + 0.002, h)]
        lathe.shell(spec, body, "rim", rim, wall + 0.003, paint(color), PLASTIC, 20)
    grips = (Hold(from_above((0, r - wall / 2, h - 0.012)), width=wall),)
    return Thing(spec, grips, spots=(up(z=wall),), symmetry=revolution())


def plate(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A flat plate with a rising rim; frame: centre of its base."""
    r, h = shape.uniform(0.06, 0.11), shape.uniform(0.012, 0.024)
    flat, wall = r * shape.uniform(0.55, 0.75), 0.004
    spec, body = part(fixed=True)
    first, second = paint(color), paint(color)
    cylinder(body, flat, 0, wall + 0.001, first, PLASTIC)
    rim = first if shape.random() < 0.5 else second
    lathe.shell(spec, body, "rim", [(flat, 0.001), (r, h)], wall, rim, PLASTIC, 20)
    grips = (Hold(from_above((0, r - 0.008, h), lean=0.0), width=wall),)
    return Thing(spec, grips, spots=(up(z=wall),), symmetry=revolution())
