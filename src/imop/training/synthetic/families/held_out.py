"""Kinds of things of the novel tasks, for testing only: no training run behind bundled weights sees them."""

import mujoco
import numpy as np

from imop.geometry import se3
from imop.sim.parts.bin import waste_bin
from imop.sim.parts.bookshelf import BOARD, BookShape, ShelfShape, book, bookshelf
from imop.sim.parts.faucet import SIDES, FaucetShape, faucet
from imop.sim.parts.hinged_box import LID, BoxShape, hinged_box
from imop.sim.parts.laptop import COVER, LaptopShape, laptop
from imop.sim.parts.pot import PotShape, lid, pot
from imop.sim.parts.rope import RopeShape
from imop.sim.parts.shapes import PLASTIC, box, capsule, part
from imop.training.synthetic.families.held_out_kinds import HELD_OUT_KINDS
from imop.training.synthetic.families.solids import HALF_TURN
from imop.training.synthetic.families.thing import (
    Family,
    Hold,
    Moving,
    Thing,
    from_above,
    from_front,
    paint,
    revolution,
    up,
)


def _pot_shape(shape: np.random.Generator) -> PotShape:
    return PotShape(
        radius=shape.uniform(0.055, 0.095),
        height=shape.uniform(0.05, 0.11),
        dome=shape.uniform(0.012, 0.035),
        knob_radius=shape.uniform(0.01, 0.019),
        knob_height=shape.uniform(0.02, 0.034),
    )


def cooking_pot(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A pot with two handles; frame: centre of its base."""
    sizes = _pot_shape(shape)
    handle = Hold(from_above((0, sizes.radius + 0.028, 0.75 * sizes.height)), width=0.012)
    spec = pot(sizes, paint(color), paint(color))
    return Thing(spec, (handle,), spots=(up(z=sizes.height), up(z=0.006)), symmetry=HALF_TURN)


def pot_lid(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A lid with a knob; frame: centre of the knob."""
    sizes = _pot_shape(shape)
    knob = Hold(from_above((0, 0, 0)), width=2 * sizes.knob_radius)
    return Thing(lid(sizes, paint(color), paint(color)), (knob,), symmetry=revolution())


def bin_(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A waste bin; frame: centre of the opening."""
    low, height = shape.uniform(0.05, 0.07), shape.uniform(0.12, 0.2)
    top = low + shape.uniform(0.005, 0.03)
    spec = waste_bin(low, top, height, paint(color), paint(color))
    rim = Hold(from_above((0, top, -0.012)), width=0.008)
    return Thing(spec, (rim,), spots=(up(z=0.02), up(z=-0.5 * height)), symmetry=revolution())


def notebook(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A laptop; frame: centre of its underside."""
    depth = shape.uniform(0.13, 0.19)
    sizes = LaptopShape(width=shape.uniform(0.18, 0.28), depth=depth, height=shape.uniform(0.012, 0.025))
    spec = laptop(sizes, paint(color), paint(color), paint(color))
    wide = shape.uniform(1.4, 2.0)
    push = Hold(from_above((depth - 0.02, 0, COVER)), "screen", 0.0)
    edge = Hold(from_front((depth, 0, COVER / 2), 0.4), "screen", COVER)
    moving = (Moving("screen", (wide, 0.1), push, push=True), Moving("screen", (0.0, 1.2), edge))
    return Thing(spec, moving=moving)


def tap(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A faucet with two levers; frame: centre of its base."""
    sizes = FaucetShape(
        spread=shape.uniform(0.085, 0.105),
        height=shape.uniform(0.075, 0.12),
        lever=shape.uniform(0.07, 0.1),
        radius=shape.uniform(0.006, 0.009),
        spout=shape.uniform(0.1, 0.14),
    )
    spec = faucet(sizes, paint(color), paint(color))
    on_lever = from_above((sizes.lever - 0.02, 0, -0.006), np.pi)
    moving = tuple(Moving(side, (0.0, 1.6), Hold(on_lever, side, 2 * sizes.radius)) for side in SIDES)
    return Thing(spec, moving=moving)


def book_(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A book; frame: middle of its top."""
    sizes = BookShape(shape.uniform(0.02, 0.045), shape.uniform(0.09, 0.14), shape.uniform(0.13, 0.18))
    hold = Hold(from_above((0, 0, -0.02)), width=sizes.thickness)
    lying = se3.euler(x=np.pi / 2)
    return Thing(book(sizes, paint(color)), (hold,), rests=(np.eye(3), lying))


def shelf(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A shelf with books and a gap; frame: floor of the gap."""
    depth, height = shape.uniform(0.1, 0.14), shape.uniform(0.1, 0.14)
    books = [
        BookShape(shape.uniform(0.018, 0.035), shape.uniform(0.75, 0.95) * depth, height)
        for _ in range(int(shape.integers(2, 6)))
    ]
    split = int(shape.integers(1, len(books)))
    sizes = ShelfShape(
        left=tuple(books[:split]),
        right=tuple(books[split:]),
        free=shape.uniform(0.03, 0.055),
        depth=depth + BOARD + 0.01,
        height=0.7 * height,
    )
    spec = bookshelf(sizes, paint(color), [paint(color) for _ in books])
    return Thing(spec, spots=(up(),))


def lidded_box(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A box with a hinged lid; frame: centre of its base."""
    sizes = BoxShape(shape.uniform(0.12, 0.18), shape.uniform(0.14, 0.26), shape.uniform(0.08, 0.15))
    spec = hinged_box(sizes, paint(color), paint(color), paint(color))
    tab = Hold(from_front((0.003, 0, 0), shape.uniform(0.2, 0.6)), "lid", 0.01)
    back = Hold(from_above((-0.035, 0, LID / 2)), "lid", 0.0)
    moving = (Moving("lid", (0.0, 1.6), tab), Moving("lid", (1.5, 0.1), back, push=True))
    return Thing(spec, spots=(up(z=sizes.height + LID),), moving=moving)


def rope(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A rope with coloured ends that lies otherwise in every scene; frame: one end, the rope along +x."""
    sizes = RopeShape(int(shape.integers(9, 13)), shape.uniform(0.018, 0.022), shape.uniform(0.006, 0.01))
    spec, body = part()
    r, half, first, bends = sizes.radius, sizes.pitch / 2, paint(color), []
    box(body, (-half, -1.6 * r, -r), (half, 1.6 * r, r), paint(color), PLASTIC)
    for i in range(1, sizes.links):
        body = body.add_body(name=f"link{i}", pos=[sizes.pitch, 0, 0])
        body.add_joint(name=f"link{i}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1], pos=[-half, 0, 0])
        bends.append(f"link{i}")
        if i < sizes.links - 1:
            capsule(body, (-half, 0, 0), (half, 0, 0), r, first, PLASTIC)
        else:
            box(body, (-half, -1.6 * r, -r), (half, 1.6 * r, r), paint(color), PLASTIC)
    return Thing(spec, (Hold(from_above((0, 0, 0)), width=3.2 * r),), bends=tuple(bends))


HELD_OUT: dict[str, Family] = {
    "pot": cooking_pot,
    "lid": pot_lid,
    "bin": bin_,
    "laptop": notebook,
    "faucet": tap,
    "book": book_,
    "shelf": shelf,
    "hinged box": lidded_box,
    "rope": rope,
    **HELD_OUT_KINDS,
}
"""What no training sees."""
