"""Knives, spatulas, hammers, brooms, screwdrivers: a handle and a working end."""

import numpy as np

from imop.geometry import se3
from imop.sim.parts import lathe
from imop.sim.parts.shapes import METAL, PLASTIC, WOOD, box, capsule, part
from imop.training.synthetic.families.thing import Hold, Thing, from_above, paint
from imop.types import FloatArray


def _facing(R: FloatArray, p: tuple[float, float, float]) -> FloatArray:
    return se3.make(R, p)


def knife(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A knife or spatula along x, its blade towards +x; frame: middle of the handle's underside."""
    long, blade = shape.uniform(0.07, 0.12), shape.uniform(0.06, 0.13)
    w, t = shape.uniform(0.008, 0.016), shape.uniform(0.01, 0.02)
    wide, thin = shape.uniform(0.012, 0.045), shape.uniform(0.002, 0.004)
    spec, body = part(fixed=True)
    box(body, (-long / 2, -w, 0), (long / 2, w, t), paint(color), WOOD)
    metal = paint(color)
    shift = shape.uniform(-0.5, 0.5) * wide
    neck = shape.uniform(0, 0.05)
    if neck > 0.01:
        capsule(body, (long / 2, 0, t / 2), (long / 2 + neck, 0, t / 2), 0.004, metal, METAL)
    else:
        neck = 0.0
    start, mid = long / 2 + neck, t / 2
    box(body, (start, shift - wide, mid - thin), (start + blade, shift + wide, mid + thin), metal, METAL)
    x = shape.uniform(-0.3, 0.3) * long
    grips = (Hold(from_above((x, 0, t / 2)), width=2 * w),)
    tip = _facing(se3.euler(y=np.pi / 2), (start + blade, shift, mid))
    on_edge = se3.euler(x=np.pi / 2)
    return Thing(spec, grips, tool=tip, rests=(np.eye(3), on_edge) if wide > 0.03 else (np.eye(3),))


def hammer(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A hammer or mallet lying along x, its head at +x; frame: middle of the handle, on the table."""
    long, r = shape.uniform(0.12, 0.2), shape.uniform(0.006, 0.011)
    head, hr = shape.uniform(0.025, 0.05), shape.uniform(0.011, 0.02)
    spec, body = part(fixed=True)
    z = hr
    capsule(body, (-long / 2, 0, z), (long / 2, 0, z), r, paint(color), WOOD)
    metal = paint(color)
    if shape.random() < 0.5:
        box(body, (long / 2 - hr, -head, 0), (long / 2 + hr, head, 2 * hr), metal, METAL)
    else:
        capsule(body, (long / 2, -head + hr, z), (long / 2, head, z), hr, metal, METAL)
    x = shape.uniform(-0.4, 0.1) * long
    grips = (Hold(from_above((x, 0, z)), width=2 * r),)
    return Thing(spec, grips, tool=_facing(se3.euler(x=-np.pi / 2), (long / 2, head, z)))


def broom(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A brush or a squeegee lying along x, bristles at +x; frame: middle of the stick, on the table."""
    long, r = shape.uniform(0.1, 0.24), shape.uniform(0.005, 0.01)
    half, depth, t = shape.uniform(0.03, 0.07), shape.uniform(0.02, 0.05), shape.uniform(0.014, 0.03)
    spec, body = part(fixed=True)
    z, end = t / 2, long / 2
    capsule(body, (-end, 0, z), (end, 0, z), r, paint(color), WOOD)
    box(body, (end, -half, 0), (end + 0.015, half, t), paint(color), PLASTIC)
    bristle = paint(color)
    box(body, (end + 0.015, -0.95 * half, 0.002), (end + 0.015 + depth, 0.95 * half, t - 0.002), bristle, 80)
    grips = (Hold(from_above((shape.uniform(-0.4, 0.1) * long, 0, z)), width=2 * r),)
    tip = _facing(se3.euler(y=np.pi / 2), (end + 0.015 + depth, 0, z))
    both = np.stack(
        [np.eye(4), se3.make(p=(0, 0, z)) @ se3.make(se3.euler(x=np.pi)) @ se3.make(p=(0, 0, -z))]
    )
    return Thing(spec, grips, tool=tip, symmetry=both)


def driver(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A screwdriver, a pen, a brush that lies along x; frame: middle of the handle, on the table."""
    long, r = shape.uniform(0.05, 0.1), shape.uniform(0.008, 0.015)
    shaft, thin = shape.uniform(0.04, 0.1), shape.uniform(0.002, 0.006)
    spec, body = part(fixed=True)
    lying = se3.make(se3.euler(y=np.pi / 2), (0, 0, r))
    inner = body.add_body(name="turned", pos=[0, 0, r], quat=[np.sqrt(0.5), 0, np.sqrt(0.5), 0])
    profile = [(0.6 * r, -long / 2), (r, -0.35 * long), (r, 0.3 * long), (0.7 * r, long / 2)]
    lathe.solid(spec, inner, "handle", profile, paint(color), PLASTIC, 12)
    metal = paint(color)
    capsule(inner, (0, 0, long / 2), (0, 0, long / 2 + shaft), thin, metal, METAL)
    grips = (Hold(from_above((0, 0, r)), width=2 * r),)
    about = [lying @ se3.make(se3.euler(z=k * np.pi / 6)) @ se3.invert(lying) for k in range(12)]
    tip = _facing(se3.euler(y=np.pi / 2), (long / 2 + shaft + thin, 0, r))
    return Thing(spec, grips, tool=tip, symmetry=np.stack(about))


def spoon(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A ladle: a stick with a cup at its end, along x; frame: middle of the stick, on the table."""
    long, r = shape.uniform(0.12, 0.2), shape.uniform(0.004, 0.008)
    cup, h = shape.uniform(0.018, 0.035), shape.uniform(0.012, 0.035)
    spec, body = part(fixed=True)
    z, end, stick = h - 0.003, long / 2, paint(color)
    capsule(body, (-end, 0, z), (end, 0, z), r, stick, WOOD)
    metal = stick if shape.random() < 0.4 else paint(color)
    bowl = body.add_body(name="bowl", pos=[end + cup, 0, 0])
    lathe.solid(spec, bowl, "floor", [(0.6 * cup, 0), (0.7 * cup, 0.004)], metal, METAL, 16)
    lathe.shell(spec, bowl, "wall", [(0.7 * cup, 0.003), (cup, h)], 0.003, metal, METAL, 16)
    grips = (Hold(from_above((shape.uniform(-0.4, 0.2) * long, 0, z)), width=2 * r),)
    return Thing(spec, grips, tool=_facing(se3.euler(x=np.pi), (end + cup, 0, 0)))
