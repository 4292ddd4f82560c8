"""Cabinets with drawers, doors with handles, sliding panels, and other furniture that opens."""

from typing import Any

import mujoco
import numpy as np

from imop.geometry import se3
from imop.sim.parts.cabinet import CabinetShape, drawer_cabinet
from imop.sim.parts.hinge import hinge
from imop.sim.parts.shapes import METAL, WOOD, Color, box, capsule, cylinder, part
from imop.training.synthetic.families.thing import (
    Floor,
    Hold,
    Moving,
    Thing,
    from_front,
    from_side,
    paint,
    up,
)


def slide(body: Any, name: str, axis: tuple[float, float, float], limit: float) -> None:
    """Let `body` slide along `axis` from 0 to `limit` metres."""
    kind = mujoco.mjtJoint.mjJNT_SLIDE
    body.add_joint(
        name=name, type=kind, axis=list(axis), range=[0, limit], limited=mujoco.mjtLimited.mjLIMITED_TRUE
    )


def drawers(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A cabinet with one to four drawers, bars for handles."""
    count = int(shape.integers(1, 5))
    sizes = CabinetShape(
        width=shape.uniform(0.14, 0.3),
        depth=shape.uniform(0.12, 0.22),
        drawer_height=shape.uniform(0.045, 0.085) if count < 4 else 0.045,
        handle_width=shape.uniform(0.04, 0.1),
        drawers=count,
    )
    spec = drawer_cabinet(sizes, paint(color), paint(color), paint(color))
    down = shape.uniform(0, 0.7)
    moving = tuple(
        Moving(f"drawer{k}", (0.0, sizes.travel), Hold(from_front((0, 0, 0), down), f"drawer{k}", 0.012))
        for k in range(count)
    )
    floors = (Floor((0, 0, sizes.height), (sizes.depth / 2, sizes.width / 2)),)
    return Thing(spec, spots=(up(z=sizes.height),), moving=moving, floors=floors)


def door(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A cupboard, oven or fridge whose door turns on one side, with a bar or a knob."""
    x, y, z = shape.uniform(0.06, 0.11), shape.uniform(0.07, 0.14), shape.uniform(0.12, 0.3)
    side = float(shape.choice((-1.0, 1.0)))
    t, wall = 0.012, 0.01
    spec, body = part(fixed=True)
    shell, front, handle = paint(color), paint(color), paint(color)
    open_box(body, x, y, z, wall, shell)
    leaf = body.add_body(name="door", pos=[x, -side * y, 0])
    hinge(leaf, "door", (0, 0, -side), (0.0, np.radians(150)))
    a, b = sorted((0.0, side * 2 * y))
    box(leaf, (0, a + 0.002, 0.004), (t, b - 0.002, z), front, WOOD)
    at, high = side * 2 * y * shape.uniform(0.8, 0.92), z * shape.uniform(0.35, 0.75)
    out = t + shape.uniform(0.02, 0.035)
    if shape.random() < 0.5:
        half = shape.uniform(0.2, 0.45) * min(z, 0.16)
        capsule(leaf, (out, at, high - half), (out, at, high + half), 0.006, handle, METAL)
        for end in (-half, half):
            capsule(leaf, (t, at, high + end), (out, at, high + end), 0.005, handle, METAL)
    else:
        capsule(leaf, (t, at, high), (out, at, high), shape.uniform(0.008, 0.015), handle, METAL)
    hold = Hold(from_side((out, at, high), down=shape.uniform(0, 0.5)), "door", 0.014)
    push = Hold(from_side((t + 0.005, at, high)), "door", 0.0)
    limit = float(np.radians(shape.uniform(60, 120)))
    moving = (Moving("door", (0.0, limit), hold), Moving("door", (limit, 0.1), push, push=True))
    return Thing(spec, spots=(up(z=z),), moving=moving)


def open_box(body: Any, x: float, y: float, z: float, wall: float, color: Color) -> None:
    """Floor, back, sides and top of a cupboard of half sizes `x`, `y` and height `z`, open towards +x."""
    box(body, (-x, -y, 0), (x, y, wall), color, WOOD)
    box(body, (-x, -y, z - wall), (x, y, z), color, WOOD)
    box(body, (-x, -y, wall), (wall - x, y, z - wall), color, WOOD)
    for side in (-1, 1):
        a, b = sorted((side * y, side * (y - wall)))
        box(body, (wall - x, a, wall), (x, b, z - wall), color, WOOD)


def panel(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A frame with a panel that slides sideways, pulled by a knob or bar."""
    y, z = shape.uniform(0.09, 0.16), shape.uniform(0.1, 0.22)
    t, wall = 0.01, shape.uniform(0.01, 0.02)
    depth = shape.uniform(0.025, 0.1)
    spec, body = part(fixed=True)
    frame, leaf_color, handle = paint(color), paint(color), paint(color)
    open_box(body, depth, y, z, wall, frame)
    width = shape.uniform(0.45, 0.6) * 2 * y
    leaf = body.add_body(name="panel", pos=[depth + 0.002, -y, 0])
    travel = 2 * y - width
    slide(leaf, "panel", (0, 1, 0), travel)
    box(leaf, (0, 0, 0.008), (t, width, z - 0.004), leaf_color, WOOD)
    at, high, out = width * shape.uniform(0.3, 0.8), z * shape.uniform(0.4, 0.7), t + 0.03
    if shape.random() < 0.5:
        capsule(leaf, (t, at, high), (out, at, high), 0.01, handle, METAL)
    else:
        box(leaf, (t, at - 0.006, high - 0.03), (out, at + 0.006, high + 0.03), handle, METAL)
    hold = Hold(from_side((out - 0.008, at, high), down=shape.uniform(0, 0.5)), "panel", 0.018)
    both = (Moving("panel", (0.0, 0.9 * travel), hold), Moving("panel", (0.9 * travel, 0.0), hold))
    return Thing(spec, spots=(up(z=z),), moving=both)


def lever(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A lever on a plinth that tips from one side to the other."""
    x, y, z = shape.uniform(0.03, 0.06), shape.uniform(0.025, 0.05), shape.uniform(0.02, 0.06)
    spec, body = part(fixed=True)
    box(body, (-x, -y, 0), (x, y, z), paint(color), WOOD)
    arm = body.add_body(name="lever", pos=[0, 0, z])
    hinge(arm, "lever", (0, 1, 0), (-1.2, 1.2))
    long, r = shape.uniform(0.06, 0.12), shape.uniform(0.004, 0.008)
    capsule(arm, (0, 0, 0), (0, 0, long), r, paint(color), METAL)
    knob = shape.uniform(0.009, 0.016)
    capsule(arm, (0, -0.004, long), (0, 0.004, long), knob, paint(color), METAL)
    a = shape.uniform(0.3, 0.8)
    grip = Hold(se3.make(np.diag([-1.0, 1.0, -1.0]), (0, 0, long)), "lever", 2 * knob)
    return Thing(spec, moving=(Moving("lever", (-a, a), grip), Moving("lever", (a, -a), grip)))


def knob(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A dial or tap wheel on a panel, upright or lying, with a pointer."""
    x, y, z = shape.uniform(0.04, 0.08), shape.uniform(0.05, 0.1), shape.uniform(0.02, 0.09)
    spec, body = part(fixed=True)
    box(body, (-x, -y, 0), (x, y, z), paint(color), WOOD)
    r, h = shape.uniform(0.015, 0.03), shape.uniform(0.018, 0.035)
    at = shape.uniform(-0.4, 0.4) * y
    dial = body.add_body(name="dial", pos=[0, at, z])
    hinge(dial, "dial", (0, 0, -1), (0.0, 3.0))
    cylinder(dial, r, 0, h / 3, paint(color), METAL)
    fin = 0.006
    box(dial, (-r, -fin, h / 3), (r, fin, h), paint(color), METAL)
    mark = paint(color)
    box(dial, (0.5 * r, -fin - 0.001, h / 3), (r + 0.001, fin + 0.001, h + 0.001), mark, METAL)
    grip = Hold(se3.make(np.diag([-1.0, 1.0, -1.0]), (0, 0, h - 0.006)), "dial", 2 * fin)
    turn = shape.uniform(0.6, 2.0)
    return Thing(spec, moving=(Moving("dial", (0.0, turn), grip), Moving("dial", (turn, 0.0), grip)))


def buttons(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A box with one to three push buttons, or one button on its housing, perhaps on a cable."""
    count = int(shape.integers(1, 4))
    pitch, r = shape.uniform(0.05, 0.07), shape.uniform(0.012, 0.024)
    x, z = r + shape.uniform(0.008, 0.02), shape.uniform(0.015, 0.05)
    y = x + (count - 1) * pitch / 2
    spec, body = part(fixed=True)
    box(body, (-x, -y, 0), (x, y, z), paint(color), WOOD)
    if shape.random() < 0.3:
        end = (-x - shape.uniform(0.04, 0.1), shape.uniform(-0.05, 0.05), 0.004)
        capsule(body, (-x, 0, 0.004), end, 0.004, paint(color), METAL)
    moving = []
    for k in range(count):
        name, high = f"cap{k}", shape.uniform(0.008, 0.02)
        cap = body.add_body(name=name, pos=[0, (k - (count - 1) / 2) * pitch, z + high])
        slide(cap, name, (0, 0, -1), 0.8 * high)
        cylinder(cap, r, -high, 0, paint(color), METAL)
        down = se3.make(np.diag([-1.0, 1.0, -1.0]))
        moving.append(Moving(name, (0.0, 0.7 * high), Hold(down, name, 0.0), push=True))
    return Thing(spec, moving=tuple(moving))


def switch(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A rocker or toggle switch on a box or an upright board."""
    x, y, z = shape.uniform(0.03, 0.05), shape.uniform(0.03, 0.05), shape.uniform(0.02, 0.05)
    spec, body = part(fixed=True)
    box(body, (-x, -y, 0), (x, y, z), paint(color), WOOD)
    plate = shape.uniform(0.6, 0.9)
    box(body, (-plate * x, -plate * y, z), (plate * x, plate * y, z + 0.004), paint(color), WOOD)
    rocker = body.add_body(name="rocker", pos=[0, 0, z + 0.006])
    hinge(rocker, "rocker", (0, 1, 0), (-0.35, 0.35))
    half, wide = shape.uniform(0.014, 0.025), shape.uniform(0.01, 0.02)
    box(rocker, (-half, -wide, -0.004), (half, wide, 0.008), paint(color), METAL)
    down = se3.make(np.diag([-1.0, 1.0, -1.0]), (0.8 * half, 0, 0.008))
    back = se3.make(np.diag([-1.0, 1.0, -1.0]), (-0.8 * half, 0, 0.008))
    moving = (
        Moving("rocker", (-0.3, 0.3), Hold(down, "rocker", 0.0), push=True),
        Moving("rocker", (0.3, -0.3), Hold(back, "rocker", 0.0), push=True),
    )
    return Thing(spec, moving=moving)
