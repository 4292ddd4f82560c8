"""Goals to which things are pushed along +x: marks with a direction, brackets, gates, stops."""

import numpy as np

from imop.geometry import se3
from imop.sim.parts.shapes import PLASTIC, WOOD, box, cylinder, part
from imop.training.synthetic.families.fittings import slanted
from imop.training.synthetic.families.thing import Thing, paint, up
from imop.types import FloatArray


def mark(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A flat mark that shows a direction: an arrow, a field with a stripe, a field with a lane before it."""
    spec, body = part(fixed=True)
    x, y, t = shape.uniform(0.03, 0.07), shape.uniform(0.03, 0.07), shape.uniform(0.001, 0.003)
    first, second = paint(color), paint(color)
    style = shape.random()
    if style < 0.35:
        wing = shape.uniform(0.5, 0.9) * y
        box(body, (-x, -0.25 * y, 0), (x, 0.25 * y, t), first, PLASTIC)
        for side in (-1.0, 1.0):
            turned = se3.euler(z=-side * shape.uniform(0.7, 0.9))
            center = np.array((x, 0, t / 2)) + turned @ (-wing / 2, 0, 0)
            slanted(body, center, (wing / 2 + 0.008, 0.008, t / 2), turned, first)
    elif style < 0.7:
        box(body, (-x, -y, 0), (x, y, t), first, PLASTIC)
        at = shape.uniform(0.3, 0.8) * x
        box(body, (at, -y, t), (x, y, t + 0.0006), second, PLASTIC)
    else:
        cylinder(body, y, 0, t, first, PLASTIC)
        box(body, (-y - 2 * x, -0.2 * y, 0), (-0.8 * y, 0.2 * y, t), second, PLASTIC)
    far = shape.uniform(0.3, 0.95) * x
    return Thing(spec, spots=(up(z=t),), goals=(up(far, 0, 0), up(0.5 * far, 0, 0)))


def berth(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """Something upright that one pushes things into or against: a bracket, a gate, a stop, a corner."""
    spec, body = part(fixed=True)
    x, y, z = shape.uniform(0.03, 0.06), shape.uniform(0.035, 0.07), shape.uniform(0.012, 0.06)
    w, first, second = shape.uniform(0.006, 0.012), paint(color), paint(color)
    style, end = shape.random(), x
    if style < 0.3:
        for side in (-1.0, 1.0):
            a, b = sorted((side * y, side * (y + w)))
            box(body, (-x, a, 0), (x, b, z), first, WOOD)
        box(body, (x, -y - w, 0), (x + w, y + w, z), second, WOOD)
    elif style < 0.55:
        for side, tone in ((-1.0, first), (1.0, second)):
            post = body.add_body(name=f"post{int(side)}", pos=[0, side * (y + w), 0])
            cylinder(post, w, 0, 1.5 * z * (1.0 if side > 0 else shape.uniform(0.5, 1.0)), tone, WOOD)
        box(body, (-0.3 * w, -y, 0), (0.3 * w, y, 0.0015), first, PLASTIC)
        end = shape.uniform(-0.01, 0.03)
    elif style < 0.8:
        box(body, (x, -y, 0), (x + 2 * w, y, z), first, WOOD)
        box(
            body,
            (x + 2 * w, -0.4 * y, 0),
            (x + 2 * w + x, 0.4 * y, z * shape.uniform(0.3, 1.0)),
            second,
            WOOD,
        )
    else:
        box(body, (x, -y, 0), (x + w, y, z), first, WOOD)
        side = float(shape.choice((-1.0, 1.0)))
        a, b = sorted((side * y, side * (y + w)))
        box(body, (-x, a, 0), (x + w, b, z), second, WOOD)
    return Thing(spec, spots=(up(0, 0, 0.001),), goals=(_ahead(end),))


def _ahead(x: float) -> FloatArray:
    return up(x, 0, 0)
