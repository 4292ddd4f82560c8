"""Several equal knobs, buttons, levers, keys or sliders in a row on one body: the place tells them apart."""

from typing import Any

import mujoco
import numpy as np

from imop.geometry import se3
from imop.sim.parts.hinge import hinge
from imop.sim.parts.shapes import METAL, PLASTIC, WOOD, Color, box, capsule, cylinder, part
from imop.training.synthetic.families.cabinets import slide
from imop.training.synthetic.families.fittings import UPRIGHT, inner
from imop.training.synthetic.families.thing import Hold, Moving, Thing, from_above, paint, up
from imop.types import FloatArray

_DOWN = from_above((0.0, 0.0, 0.0))[:3, :3]


def row(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """Three to six of them on a box that lies, leans or stands, in one row or in two."""
    spec, body = part(fixed=True)
    style = str(shape.choice(("dial", "button", "toggle", "slider", "key", "plug")))
    rows = int(shape.random() < 0.3 and style in ("button", "dial", "plug")) + 1
    count = int(shape.integers(3, 7)) if rows == 1 else int(shape.integers(2, 4))
    pitch = shape.uniform(0.042, 0.055)
    y = count * pitch / 2 + shape.uniform(0.0, 0.02)
    x = (0.04 if rows == 1 else 0.05) + shape.uniform(0.0, 0.02)
    z, lean = shape.uniform(0.015, 0.05), float(shape.choice((0.0, 0.0, 0.35, 0.6)))
    case, element, second = paint(color), paint(color), paint(color)
    plate = _case(body, x, y, z, lean, case)
    _end(shape, plate, x, y, second, paint(color))
    size, moving = shape.uniform(0.3, 0.38) * pitch, []
    turn, drop = shape.uniform(0.5, 1.6), shape.uniform(0.008, 0.02)
    for k in range(rows * count):
        across = 0.0 if rows == 1 else (k // count - 0.5) * pitch
        p = (across, (k % count - (count - 1) / 2) * pitch, 0.0)
        name = f"{style}{k}"
        moving.append(_ELEMENTS[style](plate, name, p, size, (turn, drop), (element, second)))
    return Thing(spec, moving=tuple(moving), row=True)


def _case(body: Any, x: float, y: float, z: float, lean: float, color: Color) -> Any:
    """A box whose upper side leans to the front (+x); returns a body in its middle, z outwards."""
    high = z + x * np.sin(lean)
    box(body, (-x, -y, 0), (x * np.cos(lean), y, max(0.006, z - 0.01)), color, WOOD)
    plate = inner(body, "plate", se3.euler(y=lean), (0.0, 0.0, high))
    box(plate, (-x, -y, -0.012), (x, y, 0), color, WOOD)
    return plate


def _end(shape: np.random.Generator, plate: Any, x: float, y: float, color: Color, other: Color) -> None:
    """What tells one end of the case from the other, and so the places of a row."""
    style = shape.random()
    if style < 0.35:
        box(plate, (-x, y, -0.012), (x, y + shape.uniform(0.01, 0.03), 0.0), color, PLASTIC)
    elif style < 0.7:
        box(plate, (-x, y - 0.006, 0), (x, y, shape.uniform(0.001, 0.02)), color, PLASTIC)
    else:
        capsule(plate, (0, y, -0.006), (-0.03, y + shape.uniform(0.02, 0.05), -0.006), 0.004, color, PLASTIC)
    box(plate, (-x, -0.8 * y, 0), (0.012 - x, shape.uniform(-0.4, 0.8) * y, 0.0008), other, PLASTIC)


Place = tuple[float, float, float]


def _dial(
    body: Any, name: str, p: Place, r: float, ways: tuple[float, float], tones: tuple[Color, Color]
) -> Moving:
    dial = inner(body, name, np.eye(3), p)
    hinge(dial, name, (0, 0, -1), (0.0, 3.0))
    cylinder(dial, r, 0, 0.012, tones[0], METAL)
    box(dial, (-r, -0.004, 0.012), (r, 0.004, 0.026), tones[0], METAL)
    box(dial, (0.4 * r, -0.0045, 0.02), (r + 0.0005, 0.0045, 0.0265), tones[1], METAL)
    return Moving(name, (0.0, ways[0]), Hold(se3.make(_DOWN, (0, 0, 0.02)), name, 0.008))


def _button(
    body: Any, name: str, p: Place, r: float, ways: tuple[float, float], tones: tuple[Color, Color]
) -> Moving:
    cap = inner(body, name, np.eye(3), (p[0], p[1], ways[1]))
    slide(cap, name, (0, 0, -1), 0.9 * ways[1])
    cylinder(cap, r, -ways[1], 0, tones[0], PLASTIC)
    return Moving(name, (0.0, 0.7 * ways[1]), Hold(se3.make(_DOWN), name, 0.0), push=True)


def _toggle(
    body: Any, name: str, p: Place, r: float, ways: tuple[float, float], tones: tuple[Color, Color]
) -> Moving:
    arm = inner(body, name, np.eye(3), p)
    hinge(arm, name, (0, 1, 0), (-0.9, 0.9))
    long = 0.03 + ways[1]
    capsule(arm, (0, 0, 0), (0, 0, long), 0.3 * r, tones[0], METAL)
    capsule(arm, (0, 0, long), (0, 0, long + 0.006), 0.5 * r, tones[1], PLASTIC)
    half = 0.4 * ways[0]
    return Moving(name, (-half, half), Hold(se3.make(_DOWN, (0, 0, long)), name, r))


def _slider(
    body: Any, name: str, p: Place, r: float, ways: tuple[float, float], tones: tuple[Color, Color]
) -> Moving:
    box(body, (-0.035, p[1] - 0.003, 0), (0.035, p[1] + 0.003, 0.0008), tones[1], PLASTIC)
    knob = inner(body, name, np.eye(3), (-0.025, p[1], 0.0))
    slide(knob, name, (1, 0, 0), 0.05)
    box(knob, (-0.006, -r, 0), (0.006, r, 0.018), tones[0], PLASTIC)
    hold = Hold(se3.make(se3.euler(z=np.pi / 2) @ _DOWN, (0, 0, 0.012)), name, 0.012)
    return Moving(name, (0.0, min(0.048, 0.03 * (0.5 + ways[0]))), hold)


def _key(
    body: Any, name: str, p: Place, r: float, ways: tuple[float, float], tones: tuple[Color, Color]
) -> Moving:
    key = inner(body, name, np.eye(3), (-0.03, p[1], 0.012))
    hinge(key, name, (0, 1, 0), (0.0, 0.4))
    box(key, (0, -1.2 * r, -0.004), (0.08, 1.2 * r, 0.006), tones[0], PLASTIC)
    return Moving(name, (0.0, 0.12), Hold(se3.make(_DOWN, (0.068, 0, 0.006)), name, 0.0), push=True)


def _plug(
    body: Any, name: str, p: Place, r: float, ways: tuple[float, float], tones: tuple[Color, Color]
) -> Moving:
    plug = inner(body, name, np.eye(3), p)
    kind = mujoco.mjtJoint.mjJNT_SLIDE
    plug.add_joint(
        name=name, type=kind, axis=[0, 0, 1], range=[0, 0.08], limited=mujoco.mjtLimited.mjLIMITED_TRUE
    )
    cylinder(plug, 0.7 * r, -0.01, 0.02 + ways[1], tones[0], PLASTIC)
    cylinder(plug, r, 0.02 + ways[1], 0.028 + ways[1], tones[1], PLASTIC)
    return Moving(name, (0.0, 0.05), Hold(se3.make(_DOWN, (0, 0, 0.024 + ways[1])), name, 2 * r))


_ELEMENTS = {
    "dial": _dial,
    "button": _button,
    "toggle": _toggle,
    "slider": _slider,
    "key": _key,
    "plug": _plug,
}


def stack(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A cabinet, a post or a wall with equal pulls above or beside each other: flat drawers, hooks, cords."""
    spec, body = part(fixed=True)
    count, pitch = int(shape.integers(3, 5)), shape.uniform(0.045, 0.06)
    y, deep = shape.uniform(0.05, 0.09), shape.uniform(0.04, 0.07)
    foot = shape.uniform(0.04, 0.07)
    z = foot + count * pitch
    case, front, pull = paint(color), paint(color), paint(color)
    box(body, (-deep, -y, 0), (deep, y, foot), case, WOOD)
    box(body, (-deep, -y, foot), (0, y, z), case, WOOD)
    box(body, (-deep, -y, z), (deep, y, z + 0.008), paint(color), WOOD)
    out, half = shape.uniform(0.02, 0.035), shape.uniform(0.015, 0.03)
    travel = shape.uniform(0.04, 0.07)
    upright = bool(shape.random() < 0.5)
    at = shape.uniform(-0.5, 0.5) * y
    moving = []
    for k in range(count):
        name = f"tray{k}"
        tray = inner(body, name, UPRIGHT, (deep, 0, foot + (k + 0.5) * pitch))
        slide(tray, name, (0, 0, 1), 0.08)
        box(
            tray,
            (0.002 - pitch / 2, 0.003 - y, -2 * deep * 0.8),
            (pitch / 2 - 0.002, y - 0.003, 0),
            front,
            WOOD,
        )
        a = (0.0, at - half, out) if not upright else (-0.35 * pitch, at, out)
        b = (0.0, at + half, out) if not upright else (0.35 * pitch, at, out)
        capsule(tray, a, b, 0.005, pull, METAL)
        for end in (a, b):
            capsule(tray, (end[0], end[1], 0), end, 0.004, pull, METAL)
        T = se3.make(p=(0, at, out)) @ _ahead(upright)
        moving.append(Moving(name, (0.0, travel), Hold(T, name, 0.01)))
    return Thing(spec, spots=(up(z=z + 0.008),), moving=tuple(moving), row=True)


def _ahead(upright: bool) -> FloatArray:
    """T_front_gripper (4, 4) against the z of a front, closing across an upright bar or a level one."""
    R = np.diag([-1.0, 1.0, -1.0])
    return se3.make(R if upright else R @ se3.euler(z=np.pi / 2))
