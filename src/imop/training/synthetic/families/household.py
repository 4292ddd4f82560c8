"""Hand-sized household things with a character of their own; most lie along x with their front at +x."""

import numpy as np

from imop.geometry import se3
from imop.sim.parts import lathe
from imop.sim.parts.shapes import METAL, PLASTIC, WOOD, box, capsule, cylinder, part
from imop.training.synthetic.families.fittings import AHEAD, TIP, ball, inner, rod, slanted
from imop.training.synthetic.families.thing import (
    TURNS,
    Hold,
    Thing,
    from_above,
    from_side,
    paint,
    revolution,
    up,
)
from imop.types import FloatArray


def _about_x(z: float) -> FloatArray:
    """(TURNS, 4, 4) turns about the line along x at height `z`."""
    axle = se3.make(AHEAD, (0, 0, z))
    return axle @ revolution(TURNS) @ se3.invert(axle)


def iron(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A flat iron: a pointed sole, a handle over it; frame: centre of the sole."""
    x, y, h = shape.uniform(0.045, 0.08), shape.uniform(0.022, 0.04), shape.uniform(0.015, 0.03)
    spec, body = part(fixed=True)
    sole, case, grip = paint(color), paint(color), paint(color)
    box(body, (-x, -y, 0), (0.3 * x, y, 0.006), sole, METAL)
    box(body, (-0.95 * x, -0.9 * y, 0.006), (0.3 * x, 0.9 * y, h), case, PLASTIC)
    wedge = np.arctan2(0.9 * y, 0.7 * x)
    for side in (-1, 1):
        R = se3.euler(z=-side * wedge)
        center = np.array((0.3 * x, side * 0.9 * y, h / 2)) + R @ (0.35 * x, -side * 0.25 * y, 0)
        slanted(body, center, (0.36 * x, 0.25 * y, h / 2), R, case)
    over, r = h + shape.uniform(0.03, 0.04), shape.uniform(0.006, 0.01)
    capsule(body, (-0.75 * x, 0, over), (0.35 * x, 0, over), r, grip, PLASTIC)
    capsule(body, (-0.75 * x, 0, h), (-0.75 * x, 0, over), r, grip, PLASTIC)
    if shape.random() < 0.6:
        capsule(body, (0.5 * x, 0, h), (0.35 * x, 0, over), r, grip, PLASTIC)
    ball(body, (0.5 * x, 0, h), (0.01, 0.01, 0.008), sole)
    grips = (Hold(from_above((shape.uniform(-0.4, 0.1) * x, 0, over)), width=2 * r),)
    return Thing(spec, grips, tool=se3.make(AHEAD, (x, 0, 0.01)))


def handset(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A telephone handset, one of its cups marked; frame: middle, on the table."""
    long, r, cup = shape.uniform(0.05, 0.08), shape.uniform(0.007, 0.012), shape.uniform(0.016, 0.025)
    h = shape.uniform(0.02, 0.035)
    spec, body = part(fixed=True)
    first = paint(color)
    capsule(body, (-long, 0, h + 0.004), (long, 0, h + 0.004), r, first, PLASTIC)
    for x, tone in ((-long, first), (long, paint(color))):
        end = inner(body, "cup" if x < 0 else "ear", np.eye(3), (x, 0, 0))
        cylinder(end, cup, 0, h, tone, PLASTIC)
    grips = (Hold(from_above((0, 0, h + 0.004)), width=2 * r),)
    return Thing(spec, grips)


def torch(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A torch, a dumb-bell, a rolling pin that lies along x, or an hourglass that stands."""
    spec, body = part(fixed=True)
    long, r, style = shape.uniform(0.035, 0.08), shape.uniform(0.007, 0.014), shape.random()
    first, second = paint(color), paint(color)
    big = r * shape.uniform(1.4, 2.2)
    if style < 0.35:
        rod(body, (-long, 0, big), (long, 0, big), r, first)
        lens = inner(body, "head", AHEAD, (long, 0, big))
        lathe.solid(spec, lens, "cone", [(r, 0), (big, 0.02), (big, 0.035)], second, PLASTIC, 16)
        cylinder(lens, 0.85 * big, 0.035, 0.036, paint(color), PLASTIC)
        grips: tuple[Hold, ...] = (Hold(from_above((shape.uniform(-0.4, 0.1) * long, 0, big)), width=2 * r),)
        return Thing(spec, grips, symmetry=_about_x(big), tool=se3.make(AHEAD, (long + 0.036, 0, big)))
    if style < 0.7:
        rod(body, (-long, 0, big), (long, 0, big), r, first)
        thick = shape.uniform(0.012, 0.035)
        for side in (-1, 1):
            rod(body, (side * (long - thick), 0, big), (side * long, 0, big), big, second)
        grips = (Hold(from_above((0, 0, big)), width=2 * r),)
        about = _about_x(big)
        return Thing(spec, grips, symmetry=np.concatenate([about, se3.make(se3.euler(z=np.pi)) @ about]))
    h, waist = 2 * long, 0.4 * r
    for k, (low, high) in enumerate(((0.0, 0.006), (h - 0.006, h))):
        cylinder(body, 1.6 * big, low, high, first if k == 0 else paint(color), WOOD)
    for k, profile in enumerate(([(big, 0.006), (waist, h / 2)], [(waist, h / 2), (big, h - 0.006)])):
        lathe.solid(spec, body, f"glass{k}", profile, second, PLASTIC, 16)
    grips = (
        Hold(from_above((0, 0, h - 0.006)), width=min(3.2 * big, 0.08)),
        Hold(from_side((0, 0, h - 0.02), down=shape.uniform(0, 0.5)), width=1.7 * big),
    )
    return Thing(spec, grips, spots=(up(z=h),), symmetry=revolution(), rests=(np.eye(3),))


def scissors(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """Scissors or tongs: two crossed bars with loops at one end; frame: the rivet, on the table."""
    a, front, back = shape.uniform(0.12, 0.35), shape.uniform(0.05, 0.09), shape.uniform(0.03, 0.06)
    w, t = shape.uniform(0.004, 0.008), shape.uniform(0.0025, 0.005)
    spec, body = part(fixed=True)
    metal, grip = paint(color), paint(color)
    loop = shape.uniform(0.011, 0.018)
    for k, side in enumerate((1, -1)):
        R, z = se3.euler(z=side * a), t * (2 * k + 1)
        middle = R @ ((front - back) / 2, 0, 0)
        slanted(body, (middle[0], middle[1], z), ((front + back) / 2, w, t), R, metal, METAL)
        eye = inner(body, f"loop{k}", np.eye(3), (*(R @ (-back - loop, 0, 0))[:2], 0.0))
        lathe.shell(spec, eye, f"loop{k}", [(loop, 0.0), (loop, 4 * t)], 0.004, grip, PLASTIC, 12)
    rod(body, (0, 0, 0), (0, 0, 4 * t + 0.002), 0.7 * w, grip)
    high = max(3 * t, TIP)
    grips = (
        Hold(from_above((0, 0, high)), width=2.6 * w),
        Hold(from_above((-back - loop, 0, high)), width=min(2 * (loop + (back + loop) * a), 0.078)),
    )
    return Thing(spec, grips, tool=se3.make(AHEAD, (front, 0, 2 * t)))


def trowel(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A trowel, a dustpan or a tooth brush: a blade below its handle; frame: under the handle."""
    long, r, drop = shape.uniform(0.07, 0.12), shape.uniform(0.007, 0.012), shape.uniform(0.01, 0.03)
    blade, wide = shape.uniform(0.04, 0.08), shape.uniform(0.012, 0.045)
    spec, body = part(fixed=True)
    first, metal, z = paint(color), paint(color), drop + r
    capsule(body, (-long / 2, 0, z), (long / 2, 0, z), r, first, WOOD)
    start = long / 2 + 0.025
    capsule(body, (long / 2, 0, z), (start, 0, 0.004), 0.004, metal, METAL)
    box(body, (start, -wide, 0), (start + blade, wide, 0.004), metal, METAL)
    style = shape.random()
    if style < 0.35:
        rim = shape.uniform(0.01, 0.025)
        for a, b in ((-wide, 0.004 - wide), (wide - 0.004, wide)):
            box(body, (start, a, 0.004), (start + blade, b, rim), metal, METAL)
    elif style < 0.65:
        box(body, (start + 0.2 * blade, -0.8 * wide, 0.004), (start + blade, 0.8 * wide, 0.02), first, 80)
    else:
        for side in (-1, 1):
            R = se3.euler(z=-side * 0.5)
            center = np.array((start + blade, side * 0.5 * wide, 0.002))
            slanted(body, center, (0.5 * wide, 0.4 * wide, 0.002), R, metal, METAL)
    grips = (Hold(from_above((shape.uniform(-0.3, 0.2) * long, 0, z)), width=2 * r),)
    tip = se3.make(AHEAD, (start + blade, 0, 0.002))
    spots = (up(start + blade / 2, 0, 0.004),) if style < 0.35 else ()
    return Thing(spec, grips, spots=spots, tool=tip)


def funnel(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A funnel or a bell on its wide rim, a lamp with its shade, or a mushroom; frame: centre of the base."""
    r, h, thin = shape.uniform(0.03, 0.06), shape.uniform(0.03, 0.06), shape.uniform(0.006, 0.011)
    spec, body = part(fixed=True)
    first, second = paint(color), paint(color)
    if shape.random() < 0.5:
        wall = 0.003
        lathe.shell(spec, body, "cone", [(r, 0.0), (thin + wall, h)], wall, first, PLASTIC, 18)
        long = shape.uniform(0.025, 0.06)
        cylinder(body, thin, h - 0.004, h + long, first if shape.random() < 0.5 else second, PLASTIC)
        hold = Hold(from_above((0, 0, h + long - 0.012)), width=2 * thin)
        return Thing(spec, (hold,), symmetry=revolution(), spots=(up(z=h + long),))
    post, foot = shape.uniform(0.05, 0.11), shape.uniform(0.6, 0.9) * r
    cylinder(body, foot, 0, 0.01, second, PLASTIC)
    cylinder(body, thin, 0.01, post + 0.01, paint(color), PLASTIC)
    narrow = r * shape.uniform(0.3, 0.95)
    lathe.solid(spec, body, "shade", [(r, post), (narrow, post + h)], first, PLASTIC, 18)
    hold = Hold(from_side((0, 0, 0.6 * post), down=shape.uniform(0.0, 0.3)), width=2 * thin)
    top = Hold(from_above((0, 0, post + h - 0.012)), width=min(2 * narrow, 0.078))
    return Thing(spec, (hold, top), symmetry=revolution(), spots=(up(z=post + h),))


def stapler(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A stapler or a clothes peg: two bars that meet at one end; frame: middle of the lower one."""
    x, y, t = shape.uniform(0.04, 0.075), shape.uniform(0.009, 0.018), shape.uniform(0.004, 0.009)
    a = shape.uniform(0.12, 0.4)
    spec, body = part(fixed=True)
    first, second = paint(color), paint(color)
    box(body, (-x, -y, 0), (x, y, 2 * t), first, PLASTIC)
    R = se3.euler(y=-a)
    long = shape.uniform(0.75, 1.0) * x
    center = np.array((-x, 0, 2 * t)) + R @ (long, 0, t)
    slanted(body, center, (long, 0.8 * y, t), R, second)
    box(body, (-x, -y, 0), (-0.75 * x, y, 4 * t), first, PLASTIC)
    grips = (Hold(from_above((float(center[0]), 0, float(center[2]))), width=1.6 * y),)
    tip = np.array((-x, 0, 2 * t)) + R @ (1.8 * long, 0, 2 * t)
    return Thing(spec, grips, (Hold(from_above(tuple(tip.tolist()))),), tool=se3.make(AHEAD, (x, 0, t)))
