"""Things that bend and lie otherwise in every scene: plugs with cables, chains, lamps with jointed necks."""

from typing import Any

import mujoco
import numpy as np

from imop.geometry import se3
from imop.sim.parts.shapes import METAL, PLASTIC, WOOD, Color, box, capsule, cylinder, part
from imop.training.synthetic.families.fittings import TIP, ball, inner, rod
from imop.training.synthetic.families.solids import QUARTER_TURNS
from imop.training.synthetic.families.thing import Hold, Moving, Thing, from_above, paint, up


def _joined(
    body: Any, name: str, p: tuple[float, float, float], axis: tuple[float, float, float] = (0, 0, 1)
) -> Any:
    """The next piece of what bends, at `p` metres of the one before, on a hinge at its origin."""
    piece = body.add_body(name=name, pos=list(p))
    piece.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=list(axis))
    return piece


def _cable(
    body: Any, start: float, pieces: int, pitch: float, r: float, color: Color
) -> tuple[Any, list[str]]:
    """A cable that leaves `body` at x = `start` backwards: its last piece, and the names of its hinges."""
    names, at = [], start
    for k in range(pieces):
        names.append(f"cable{k}")
        body = _joined(body, names[-1], (at, 0, 0))
        capsule(body, (0, 0, 0), (-pitch, 0, 0), r, color, PLASTIC)
        at = -pitch
    return body, names


def plug(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A plug, a mouse or a hand switch that is taken, its cable behind it; frame: middle of the plug."""
    x, y, z = shape.uniform(0.014, 0.03), shape.uniform(0.009, 0.018), shape.uniform(0.008, 0.016)
    spec, body = part(fixed=True)
    first, second, style = paint(color), paint(color), shape.random()
    if style < 0.4:
        box(body, (-x, -y, -z), (x, y, z), first, PLASTIC)
        for side in (-0.5, 0.5):
            rod(body, (x, side * y, 0), (x + 0.016, side * y, 0), 0.0025, second)
        box(body, (-0.5 * x, -0.3 * y, z), (0.5 * x, 0.3 * y, z + 0.002), second, PLASTIC)
    elif style < 0.7:
        ball(body, (0, 0, 0), (1.3 * x, y, z), first)
        ball(body, (0.7 * x, 0, 0.7 * z), (0.006, 0.004, 0.005), second)
    else:
        box(body, (-x, -y, -z), (1.4 * x, y, z), first, PLASTIC)
        box(body, (-0.2 * x, -0.7 * y, z), (x, 0.7 * y, z + 0.004), second, PLASTIC)
    r = min(shape.uniform(0.0025, 0.005), 0.4 * z)
    pieces, pitch = int(shape.integers(5, 11)), shape.uniform(0.014, 0.024)
    last, bends = _cable(body, -x, pieces, pitch, r, paint(color))
    if shape.random() < 0.5:
        at = -pitch
        box(last, (at - 0.03, -0.014, -min(z, 0.012)), (at, 0.014, min(z, 0.012)), paint(color), PLASTIC)
    hold = Hold(from_above((0, 0, 0)), width=2 * y)
    tip = se3.make(se3.euler(y=np.pi / 2), (x + 0.016, 0, 0))
    pokes = (Hold(from_above((0.3 * x, 0, z))),) if style > 0.4 else ()
    return Thing(spec, (hold,), pokes, bends=tuple(bends), tool=tip if style < 0.4 else None)


def chain(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A chain or a strip of beads that is fixed to a block and lies on the table; frame: under the block."""
    x, z = shape.uniform(0.015, 0.03), shape.uniform(0.015, 0.04)
    spec, body = part(fixed=True)
    box(body, (-x, -x, 0), (x, x, z), paint(color), WOOD)
    high = shape.uniform(0.004, 0.02)
    cylinder(body, shape.uniform(0.3, 0.8) * x, z, z + high, paint(color), PLASTIC)
    beads, colors = bool(shape.random() < 0.5), (paint(color), paint(color))
    r, pitch, pieces = shape.uniform(0.005, 0.009), shape.uniform(0.018, 0.026), int(shape.integers(4, 9))
    piece, bends, at = body, [], (-x, 0.0, r)
    for k in range(pieces):
        bends.append(f"piece{k}")
        piece = _joined(piece, bends[-1], at)
        at = (-pitch, 0.0, 0.0)
        if beads:
            ball(piece, (-pitch / 2, 0, 0), (0.55 * pitch, r, r), colors[k % 2])
        else:
            half = 0.5 * r if k % 2 else r
            box(piece, (-pitch, -half, -1.5 * r + half), (0, half, 1.5 * r - half), colors[k % 2], METAL)
    grip = _joined(piece, "grip", at)
    end, wide = shape.uniform(0.03, 0.05), shape.uniform(0.008, 0.014)
    box(grip, (-end, -wide, -r), (0, wide, r), paint(color), PLASTIC)
    hold = Hold(from_above((-end / 2, 0, TIP - r)), "grip", 2 * wide)
    turn = shape.uniform(0.6, 1.0)
    moving = (Moving("grip", (-turn, turn), hold), Moving("grip", (turn, -turn), hold))
    return Thing(spec, spots=(up(z=z + high),), moving=moving, bends=tuple(bends), symmetry=QUARTER_TURNS)


def lamp(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A desk lamp on a neck with joints or one that winds, whose head one presses; frame: its base."""
    spec, body = part(fixed=True)
    base, r = shape.uniform(0.035, 0.055), shape.uniform(0.004, 0.007)
    foot, neck = paint(color), paint(color)
    if shape.random() < 0.5:
        cylinder(body, base, 0, 0.015, foot, METAL)
    else:
        box(body, (-base, -base, 0), (base, base, 0.015), foot, METAL)
    knob = 0.3 * base
    ball(body, (0.5 * base, 0.4 * base, 0.015), (knob, knob, 0.012), paint(color))
    pieces = int(shape.integers(2, 4)) if shape.random() < 0.5 else int(shape.integers(5, 9))
    pitch, lean = shape.uniform(0.13, 0.2) / pieces, shape.uniform(-0.2, 0.2)
    piece = inner(body, "socket", se3.euler(y=lean), (-0.4 * base, 0, 0.012))
    bends, at = [], (0.0, 0.0, 0.0)
    for k in range(pieces):
        # Necks sway forth and back, and a little sideways.
        bends.append(f"neck{k}")
        piece = _joined(piece, bends[-1], at, (0, 1, 0) if k % 3 != 1 else (0.5, 0.8, 0))
        at = (0.0, 0.0, pitch)
        capsule(piece, (0, 0, 0), at, r, neck, METAL)
        if pieces < 4:
            rod(piece, (0, -0.01, 0), (0, 0.01, 0), 1.8 * r, foot)
    head = _joined(piece, "head", at, (0, 1, 0))
    long, thick = shape.uniform(0.05, 0.1), shape.uniform(0.01, 0.02)
    shade, glow = paint(color), paint(color)
    if shape.random() < 0.5:
        box(head, (-0.01, -0.6 * thick, -0.3 * thick), (long, 0.6 * thick, 0.4 * thick), shade, METAL)
        box(head, (0.2 * long, -0.5 * thick, -0.5 * thick), (0.95 * long, 0.5 * thick, 0), glow, PLASTIC)
    else:
        ball(head, (0.5 * long, 0, 0), (0.5 * long + 0.01, 0.7 * thick, 0.6 * thick), shade)
        ball(head, (0.8 * long, 0, -0.3 * thick), (0.2 * long, 0.5 * thick, 0.5 * thick), glow)
    press = Hold(from_above((0.6 * long, 0, 0.5 * thick)), "head", 0.0)
    hold = Hold(from_above((0.6 * long, 0, 0)), "head", 1.4 * thick)
    dip = shape.uniform(0.3, 0.6)
    moving = (Moving("head", (-0.2, dip), press, push=True), Moving("head", (dip, -dip), hold))
    return Thing(spec, moving=moving, bends=tuple(bends))
