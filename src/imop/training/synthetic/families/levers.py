"""Things with handles that turn: latches, cranks, pumps, valves, signals, throttles, door handles."""

import numpy as np

from imop.geometry import se3
from imop.sim.parts.shapes import METAL, PLASTIC, WOOD, box, capsule, cylinder, part
from imop.training.synthetic.families.fittings import UPRIGHT, ball, board, down_upright, inner, link, rod
from imop.training.synthetic.families.thing import Hold, Moving, Thing, from_above, paint


def both_ways(joint: str, low: float, high: float, hold: Hold) -> tuple[Moving, Moving]:
    """A joint that one moves from `low` to `high` and back by the same hold."""
    return Moving(joint, (low, high), hold), Moving(joint, (high, low), hold)


def latch(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A gate latch: a bar on a board that turns out of its keeper."""
    side, long = float(shape.choice((-1.0, 1.0))), shape.uniform(0.07, 0.12)
    upright = bool(shape.random() < 0.6)
    x = shape.uniform(0.13, 0.15) if upright else shape.uniform(0.03, 0.06)
    y, w, high = long / 2 + shape.uniform(0.01, 0.04), shape.uniform(0.005, 0.009), 0.014
    spec, body = part(fixed=True)
    plate = board(body, x, y, upright, paint(color))
    metal, keeper = paint(color), paint(color)
    cylinder(plate, w + 0.006, 0, 0.006, metal, METAL)
    pivot = -side * long / 2
    bar = link(plate, "bar", (0, pivot, high), (0, 0, -side), (0.0, 1.7))
    rod(bar, (0, 0, -high), (0, 0, 0.008), w + 0.002, metal)
    a, b = sorted((0.0, side * long))
    box(bar, (-w, a, -0.005), (w, b, 0.005), metal, METAL)
    if shape.random() < 0.5:
        rod(bar, (0, side * 0.6 * long, 0), (0, side * 0.6 * long, 0.025), w, paint(color))
    end = side * long / 2
    a, b = sorted((end - side * 0.006, end - side * 0.022))
    box(plate, (w + 0.002, a, 0), (w + 0.012, b, high + 0.012), keeper, METAL)
    hold = Hold(from_above((0, side * 0.6 * long, 0.004), np.pi / 2), "bar", 2 * w)
    turn = shape.uniform(0.8, 1.2 if upright else 1.6)
    return Thing(spec, moving=both_ways("bar", 0.0, turn, hold))


def handle(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A door handle: a lever on a plate with a keyhole, on a board that stands."""
    side, long = float(shape.choice((-1.0, 1.0))), shape.uniform(0.07, 0.11)
    x, y = shape.uniform(0.12, 0.15), shape.uniform(0.07, 0.11)
    high = -shape.uniform(0.0, 0.2) * x
    spec, body = part(fixed=True)
    plate = board(body, x, y, True, paint(color), shape.uniform(0.012, 0.025))
    metal, r, out = paint(color), shape.uniform(0.005, 0.008), shape.uniform(0.03, 0.045)
    at = -side * shape.uniform(0.2, 0.6) * y
    if shape.random() < 0.6:
        box(plate, (high - 0.03, at - 0.016, 0), (high + 0.07, at + 0.016, 0.004), paint(color), METAL)
        box(plate, (high + 0.04, at - 0.003, 0), (high + 0.052, at + 0.003, 0.006), paint(color), METAL)
    else:
        rose = inner(plate, "rose", np.eye(3), (high, at, 0))
        cylinder(rose, 0.022, 0, 0.006, paint(color), METAL)
    lever = link(plate, "lever", (high, at, out), (0, 0, -side), (0.0, 1.2))
    capsule(lever, (0, 0, -out), (0, 0, 0), 1.3 * r, metal, METAL)
    capsule(lever, (0, 0, 0), (0, side * long, 0), r, metal, METAL)
    tip = 0.75 * side * long
    front = Hold(from_above((0, tip, 0), np.pi / 2), "lever", 2 * r)
    push = Hold(down_upright((-r, tip, 0)), "lever", 0.0)
    turn = shape.uniform(0.4, 1.0)
    moving = (Moving("lever", (0.0, turn), front), Moving("lever", (0.0, turn), push, push=True))
    return Thing(spec, moving=moving)


def crank(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A hand mill: a crank with a knob, on its top or in front."""
    x, y, z = shape.uniform(0.03, 0.05), shape.uniform(0.03, 0.05), shape.uniform(0.05, 0.1)
    front = bool(shape.random() < 0.5)
    z += 0.08 if front else 0.0
    spec, body = part(fixed=True)
    case = paint(color)
    box(body, (-x, -y, 0), (x, y, z), case, WOOD)
    box(body, (-x - 0.012, -y - 0.012, 0), (x + 0.012, y + 0.012, 0.01), paint(color), WOOD)
    long, r, knob = shape.uniform(0.04, 0.075), shape.uniform(0.004, 0.006), shape.uniform(0.007, 0.012)
    grip, metal = shape.uniform(0.025, 0.04), paint(color)
    if front:
        cylinder(body, 0.6 * y, z, z + 0.02, paint(color), PLASTIC)
        capsule(body, (0, 0.5 * y, 0.3 * z), (0, y + 0.03, 0.2 * z), 0.01, case, PLASTIC)
        face = inner(body, "face", UPRIGHT, (x, 0, z - 0.02))
    else:
        capsule(body, (x, 0, 0.3 * z), (x + 0.012, 0, 0.3 * z), 0.007, paint(color), PLASTIC)
        face = inner(body, "face", np.eye(3), (0, 0, z))
    start = se3.euler(z=shape.uniform(-np.pi, np.pi))
    arm = link(face, "crank", (0, 0, 0.014), (0, 0, float(shape.choice((-1.0, 1.0)))), (0.0, 3.0), start)
    rod(arm, (0, 0, -0.014), (0, 0, 0.004), 1.5 * r, metal)
    capsule(arm, (0, 0, 0), (long, 0, 0.008), r, metal, METAL)
    capsule(arm, (long, 0, 0.01), (long, 0, grip), knob, paint(color), PLASTIC)
    yaw = shape.uniform(-0.6, 0.6)
    hold = Hold(from_above((long, 0, grip), yaw), "crank", 2 * knob)
    return Thing(spec, moving=both_ways("crank", 0.0, shape.uniform(0.8, 1.7), hold))


def pump(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A pump: a column with a spout to one side and a handle that goes up and down."""
    side, h, r = float(shape.choice((-1.0, 1.0))), shape.uniform(0.07, 0.14), shape.uniform(0.014, 0.024)
    spec, body = part(fixed=True)
    iron = paint(color)
    box(body, (-0.04, -0.04, 0), (0.04, 0.04, 0.01), paint(color), WOOD)
    cylinder(body, r, 0.01, h, iron, METAL)
    reach, low = r + shape.uniform(0.025, 0.05), shape.uniform(0.55, 0.75) * h
    capsule(body, (0, 0, low), (0, side * reach, low), 0.007, iron, METAL)
    capsule(body, (0, side * reach, low), (0, side * (reach + 0.01), low - 0.02), 0.007, iron, METAL)
    box(body, (-0.006, -0.012, h), (0.006, -0.008, h + 0.03), iron, METAL)
    box(body, (-0.006, 0.008, h), (0.006, 0.012, h + 0.03), iron, METAL)
    arm = link(body, "pump", (0, 0, h + 0.022), (0, 1, 0), (-1.0, 1.0))
    long, thin, grip = shape.uniform(0.08, 0.13), shape.uniform(0.005, 0.008), paint(color)
    capsule(arm, (-0.02, 0, 0), (long, 0, 0), thin, grip, METAL)
    if shape.random() < 0.5:
        capsule(arm, (long, -0.015, 0), (long, 0.015, 0), thin, grip, METAL)
    hold = Hold(from_above((long - 0.025, 0, 0)), "pump", 2 * thin)
    press = Hold(from_above((long - 0.01, 0, thin)), "pump", 0.0)
    a = shape.uniform(0.3, 0.6)
    moving = (*both_ways("pump", -a, a, hold), Moving("pump", (-a, a), press, push=True))
    return Thing(spec, moving=moving)


def valve(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A valve: a pipe stub with a flange on one end, and one bar to turn, above or in front."""
    long, r, high = shape.uniform(0.05, 0.1), shape.uniform(0.012, 0.02), shape.uniform(0.04, 0.09)
    front = bool(shape.random() < 0.4)
    high += 0.05 if front else 0.0
    spec, body = part(fixed=True)
    pipe, stem = paint(color), shape.uniform(0.03, 0.05)
    rod(body, (0, -long, high), (0, long, high), r, pipe)
    rod(body, (0, long - 0.012, high), (0, long, high), 1.6 * r, pipe)
    foot = 0.5 * long
    for y in (-foot, foot):
        box(body, (-0.02, y - 0.006, 0), (0.02, y + 0.006, high), paint(color) if y < 0 else pipe, METAL)
    top = inner(body, "stem", UPRIGHT if front else np.eye(3), (0, 0, high))
    cylinder(top, 0.6 * r, 0, stem, pipe, METAL)
    start = se3.euler(z=shape.choice((0.0, 0.5, -0.5, 1.0)) * np.pi)
    bar = link(top, "bar", (0, 0, stem), (0, 0, float(shape.choice((-1.0, 1.0)))), (0.0, 1.7), start)
    w, thick, reach = shape.uniform(0.005, 0.01), shape.uniform(0.004, 0.007), shape.uniform(0.05, 0.085)
    paint_bar = paint(color)
    cylinder(bar, 0.75 * r, -0.006, thick, paint_bar, METAL)
    one_sided = shape.random() < 0.6
    back = -0.01 if one_sided else -shape.uniform(0.4, 0.8) * reach
    box(bar, (back, -w, -thick), (reach, w, thick), paint_bar, METAL)
    x = 0.7 * reach if one_sided else 0.0
    hold = Hold(from_above((x, 0, 0)), "bar", 2 * w if one_sided else max(2 * w, 1.5 * r))
    return Thing(spec, moving=both_ways("bar", 0.0, shape.uniform(1.0, 1.6), hold))


def signal(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A signal post: two arms that are mirror images, and a lamp on one side that tells them apart."""
    h, side = shape.uniform(0.11, 0.19), float(shape.choice((-1.0, 1.0)))
    r, long = shape.uniform(0.006, 0.012), shape.uniform(0.06, 0.1)
    spec, body = part(fixed=True)
    post = paint(color)
    box(body, (-0.04, -0.05, 0), (0.04, 0.05, 0.012), paint(color), WOOD)
    rod(body, (0, 0, 0.012), (0, 0, h + 0.02), r, post)
    low, glow = shape.uniform(0.3, 0.6) * h, shape.uniform(0.012, 0.02)
    capsule(body, (0, 0, low), (0, side * (r + glow), low), 0.005, post, METAL)
    ball(body, (0, side * (r + glow), low), (glow, glow, glow), paint(color))
    w, t, arms = shape.uniform(0.005, 0.008), shape.uniform(0.005, 0.012), paint(color)
    at, rest, swing = r + 0.01, shape.uniform(-0.6, 0.2), shape.uniform(0.5, 0.9)
    moving: list[Moving] = []
    for name, way in (("left", 1.0), ("right", -1.0)):
        capsule(body, (0, 0, h), (0, way * at, h), 0.006, post, METAL)
        arm = link(body, name, (0, way * at, h), (0, -1, 0), (-1.2, 1.2), se3.euler(z=way * np.pi / 2))
        box(arm, (0, -w, -t), (long, w, t), arms, PLASTIC)
        hold = Hold(from_above((long - 0.015, 0, 0)), name, 2 * w)
        moving += both_ways(name, rest, rest + swing, hold)
    return Thing(spec, moving=tuple(moving))


def throttle(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """Two equal levers, or two pedals, beside each other; a block on one side tells them apart."""
    x, y, z = shape.uniform(0.03, 0.06), shape.uniform(0.05, 0.085), shape.uniform(0.02, 0.06)
    spec, body = part(fixed=True)
    box(body, (-x, -y, 0), (x, y, z), paint(color), WOOD)
    side, apart = float(shape.choice((-1.0, 1.0))), shape.uniform(0.4, 0.65) * y
    a, b = sorted((side * y, side * (y + shape.uniform(0.01, 0.03))))
    box(body, (-x, a, 0), (shape.uniform(0, 1) * x, b, z + shape.uniform(0.0, 0.03)), paint(color), WOOD)
    pedals, first, second = bool(shape.random() < 0.4), paint(color), paint(color)
    long, r, knob = shape.uniform(0.05, 0.09), shape.uniform(0.004, 0.007), shape.uniform(0.008, 0.013)
    moving: list[Moving] = []
    for name, way in (("left", 1.0), ("right", -1.0)):
        if pedals:
            arm = link(body, name, (-0.8 * x, way * apart, z + 0.006), (0, 1, 0), (-1.2, 0.2))
            half = min(0.8 * apart, 0.03)
            box(arm, (0, -half, -0.003), (long, half, 0.003), first, PLASTIC)
            press = Hold(from_above((long - 0.012, 0, 0.003)), name, 0.0)
            moving.append(Moving(name, (-0.6, -0.05), press, push=True))
            continue
        arm = link(body, name, (0, way * apart, z), (0, 1, 0), (-1.2, 1.2))
        capsule(arm, (0, 0, 0), (0, 0, long), r, first, METAL)
        capsule(arm, (0, -0.006, long), (0, 0.006, long), knob, second, PLASTIC)
        tilt = float(np.clip(6 * long, 0.35, 0.6))
        moving += both_ways(name, -tilt, tilt, Hold(from_above((0, 0, long)), name, 2 * knob))
    return Thing(spec, moving=tuple(moving))
