"""Things for the kinds of goals in `plans.SHARES`, of another make than those of training: to test on."""

import mujoco
import numpy as np

from imop.geometry import se3
from imop.sim.parts import lathe
from imop.sim.parts.shapes import METAL, PLASTIC, WOOD, box, capsule, cylinder, part
from imop.training.synthetic.families.fittings import ball, inner, link, slanted
from imop.training.synthetic.families.thing import (
    Family,
    Floor,
    Hold,
    Moving,
    Thing,
    from_above,
    from_side,
    paint,
    up,
)

_STRAIGHT = np.diag([-1.0, 1.0, -1.0])


def drill_stand(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A column with an arm over a foot plate; what is held is pushed under the arm, or up to the column."""
    spec, body = part(fixed=True)
    x, y, high = shape.uniform(0.05, 0.08), shape.uniform(0.04, 0.06), shape.uniform(0.12, 0.2)
    first, second = paint(color), paint(color)
    box(body, (-x, -y, 0), (x, y, 0.01), first, METAL)
    at = -x + 0.015
    capsule(body, (at, 0, 0.01), (at, 0, high), 0.009, second, METAL)
    reach = shape.uniform(0.6, 1.0) * x
    slanted(body, (at + reach / 2, 0, high), (reach / 2 + 0.015, 0.014, 0.012), np.eye(3), first)
    ball(body, (at + reach, 0, high - 0.02), (0.013, 0.013, 0.02), paint(color))
    low = shape.uniform(0.012, 0.03)
    return Thing(spec, keeps=(up(at + reach, 0, low), up(at + 0.03, 0, low)))


def letter_tray(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A wire basket: a floor with a fence of rods, one side open, in which things lie."""
    spec, body = part(fixed=True)
    x, y, z = shape.uniform(0.1, 0.15), shape.uniform(0.09, 0.13), shape.uniform(0.03, 0.06)
    floor, wire, t = paint(color), paint(color), 0.004
    box(body, (-x, -y, 0), (x, y, t), floor, PLASTIC)
    fences = (((-x, -y), (x, -y)), ((-x, y), (x, y)), ((-x, -y), (-x, y)))
    for a, b in fences:
        for high in (0.5 * z, z):
            capsule(body, (*a, high), (*b, high), 0.0025, wire, METAL)
        for share in np.linspace(0, 1, 7):
            p = (1 - share) * np.array(a) + share * np.array(b)
            capsule(body, (*p, t), (*p, z), 0.002, wire, METAL)
    return Thing(spec, spots=(up(z=t),), floors=(Floor((0, 0, t), (x - 0.006, y - 0.006)),))


def funnel_goal(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """Two slanted rails that narrow to a lamp post: a thing is pushed in at the wide end."""
    spec, body = part(fixed=True)
    long, wide, z = shape.uniform(0.05, 0.08), shape.uniform(0.05, 0.08), shape.uniform(0.01, 0.03)
    rails, lean = paint(color), shape.uniform(0.25, 0.6)
    for side, tone in ((-1.0, rails), (1.0, paint(color))):
        R = se3.euler(z=-side * lean)
        slanted(body, (0, side * wide, z / 2), (long, 0.005, z / 2), R, tone)
    post = body.add_body(name="post", pos=[long + 0.02, 0, 0])
    cylinder(post, 0.012, 0, shape.uniform(0.04, 0.12), paint(color), WOOD)
    return Thing(spec, goals=(up(long + 0.006, 0, 0),))


def manhole(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A drum with a square shaft or a ledge around a round one: a hole in a round top, off its middle."""
    spec, body = part(fixed=True)
    high, wall = shape.uniform(0.03, 0.07), shape.uniform(0.025, 0.04)
    r = shape.uniform(0.075, 0.1)
    first, second = paint(color), paint(color)
    lathe.shell(spec, body, "drum", [(r, 0.0), (0.93 * r, high)], wall, first, PLASTIC, 24)
    inside, low = r - wall, shape.uniform(0.002, 0.5 * high)
    cylinder(body, r - 0.9 * wall, 0, low, second, PLASTIC)
    chord = shape.uniform(-0.2, 0.3) * inside
    box(body, (-inside, -inside, 0.002), (chord, inside, high), first, PLASTIC)
    at = (chord + inside) / 2
    capsule(body, (-0.75 * r, 0.0, high), (-0.45 * r, 0.3 * r, high + 0.01), 0.006, paint(color), METAL)
    hole = up(at, 0, low)
    return Thing(spec, spots=(hole,), holes=(hole, up(at, 0, high)))


def organ(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """Equal stops on an arc around a desk, which are pulled up, or equal flaps, which are tipped."""
    spec, body = part(fixed=True)
    count, r = int(shape.integers(4, 7)), shape.uniform(0.09, 0.13)
    span, high = shape.uniform(0.32, 0.4) * count, shape.uniform(0.02, 0.05)
    desk, stop, head = paint(color), paint(color), paint(color)
    angles = np.linspace(-span / 2, span / 2, count)
    for a in angles:
        slanted(
            body, (r * np.cos(a) - r, r * np.sin(a), high / 2), (0.035, 0.026, high / 2), se3.euler(z=a), desk
        )
    end = se3.euler(z=span / 2) @ (r, 0.035, 0) - (r, 0, 0)
    ball(body, (end[0], end[1], high / 2), (0.02, 0.02, 0.02), paint(color))
    pull, moving, tall = bool(shape.random() < 0.5), [], shape.uniform(0.02, 0.035)
    far = shape.uniform(0.02, 0.035) if pull else shape.uniform(0.4, 0.9)
    for k, a in enumerate(angles):
        name, p = f"stop{k}", (r * np.cos(a) - r, r * np.sin(a), high)
        if pull:
            rod = inner(body, name, se3.euler(z=a), p)
            slide = mujoco.mjtJoint.mjJNT_SLIDE
            rod.add_joint(
                name=name,
                type=slide,
                axis=[0, 0, 1],
                range=[0, 0.05],
                limited=mujoco.mjtLimited.mjLIMITED_TRUE,
            )
            capsule(rod, (0, 0, -0.01), (0, 0, tall), 0.004, stop, METAL)
        else:
            rod = link(body, name, p, (0, -1, 0), (-1.0, 1.0), se3.euler(z=a))
            slanted(rod, (0, 0, tall / 2), (0.004, 0.012, tall / 2), np.eye(3), stop)
        ball(rod, (0, 0, tall), (0.009, 0.009, 0.007), head)
        hold = Hold(se3.make(_STRAIGHT, (0, 0, tall)), name, 0.018)
        moving.append(Moving(name, (0.0, far), hold))
    return Thing(spec, moving=tuple(moving), row=True)


def beehive(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A stack of rounded square storeys, alike from four sides but for one flight hole with a lip."""
    spec, body = part(fixed=True)
    r, storeys = shape.uniform(0.05, 0.08), int(shape.integers(2, 4))
    tall = shape.uniform(0.025, 0.04)
    first, second = paint(color), paint(color)
    for k in range(storeys):
        level = inner(body, f"storey{k}", se3.euler(z=np.pi / 4), (0, 0, k * tall))
        profile = [(r, 0.0), (r, 0.8 * tall), (0.92 * r, tall)]
        lathe.solid(spec, level, f"storey{k}", profile, first if k % 2 else second, PLASTIC, 4)
    z, flat = storeys * tall, r * np.cos(np.pi / 4)
    lip, half, high = shape.uniform(0.012, 0.025), shape.uniform(0.008, 0.016), shape.uniform(0.4, 0.8) * z
    tone = paint(color)
    ball(body, (flat, 0, high), (0.004, half, 0.01), paint(color))
    box(body, (flat - 0.004, -half, high - 0.014), (flat + lip, half, high - 0.008), tone, WOOD)
    side = shape.uniform(0.2, 0.7)
    grip = Hold(from_side((flat + 0.6 * lip, 0, high - 0.011), down=side), width=2 * half)
    poke = Hold(from_above((flat + 0.7 * lip, 0, high - 0.008)), width=0.0)
    return Thing(spec, (grip,), pokes=(poke,), spots=(up(0.6 * flat, 0, z),), sided=True)


HELD_OUT_KINDS: dict[str, Family] = {
    "drill stand": drill_stand,
    "letter tray": letter_tray,
    "funnel goal": funnel_goal,
    "manhole": manhole,
    "organ": organ,
    "beehive": beehive,
}
"""One for each kind: keep, unpack, shove, sink, row, side."""
