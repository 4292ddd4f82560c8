"""Links of random machines: arms, wheels, flaps, sticks, riders and plungers on a hinge or a slide."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from imop.geometry import se3
from imop.training.synthetic.families.primitives import Piece, disc, grip, mirrored, rod, slab
from imop.training.synthetic.families.thing import up
from imop.types import FloatArray

_OUT = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Link:
    """What moves, with its joint at 0, in the frame of the body.

    Attributes:
        pieces: what it is made of.
        axis: (3,) of the joint, which passes through `at` if it is a hinge.
        at: (3,) metres.
        turns: whether it is a hinge, not a slide.
        positions: where it may stand, radians or metres.
        T: (4, 4) T_body_gripper of its hold.
        width: of the hold; 0 for closed fingers that push.
        fixed: pieces of the base that it runs on.
    """

    pieces: tuple[Piece, ...]
    axis: FloatArray
    at: FloatArray
    turns: bool
    positions: tuple[float, float]
    T: FloatArray
    width: float
    fixed: tuple[Piece, ...] = ()

    def moved(self, T: FloatArray) -> "Link":
        """The same one after a motion (4, 4) of the body."""
        return replace(
            self,
            pieces=tuple(piece.moved(T) for piece in self.pieces),
            fixed=tuple(piece.moved(T) for piece in self.fixed),
            axis=T[:3, :3] @ self.axis,
            at=se3.apply(T, self.at[None])[0],
            T=T @ self.T,
        )

    def mirrored(self) -> "Link":
        """Its mirror image about the plane y = 0 of the body."""
        flip = np.array([1.0, -1.0, 1.0])
        return replace(
            self,
            pieces=tuple(piece.mirrored() for piece in self.pieces),
            fixed=tuple(piece.mirrored() for piece in self.fixed),
            axis=-flip * self.axis if self.turns else flip * self.axis,
            at=flip * self.at,
            T=mirrored(self.T),
        )

    def motion(self, position: float) -> FloatArray:
        """(4, 4) of the body's frame, from the joint at 0."""
        if not self.turns:
            return se3.make(p=position * self.axis)
        R = Rotation.from_rotvec(position * self.axis).as_matrix()
        return se3.make(R, self.at - R @ self.at)

    def points(self) -> FloatArray:
        """(N, 3) points of its surface."""
        return np.concatenate([piece.points() for piece in self.pieces])


def _crank(rng: np.random.Generator) -> Link:
    """An arm that turns in its plane, with a knob or held by itself."""
    long, r, high = rng.uniform(0.025, 0.1), rng.uniform(0.005, 0.01), rng.uniform(0.008, 0.025)
    back = rng.choice((0.0, 0.02))
    arm = (
        slab((-back, -r, high - 2 * r), (long, r, high))
        if rng.random() < 0.5
        else rod((-back, 0, high - r), (long, 0, high - r), r)
    )
    pieces = [disc(rng.uniform(0.008, 0.016), 0.001, high), arm]
    width, up_ = 2 * r, high - 0.5 * r
    at = long - 0.012
    if rng.random() < 0.6:
        knob, tall = rng.uniform(0.006, 0.014), rng.uniform(0.018, 0.04)
        pieces.append(disc(knob, high - 0.002, high + tall, knob * rng.uniform(0.6, 1.3)))
        pieces[-1] = pieces[-1].moved(up(x=long - 0.006))
        width, up_, at = 2.6 * knob, high + 0.6 * tall, long - 0.006
    T = grip(np.eye(3)[1], -_OUT, (at, 0, up_))
    turn = rng.uniform(0.6, 2.2) * rng.choice((-1.0, 1.0))
    return Link(tuple(pieces), _OUT, np.zeros(3), True, (0.0, turn), T, width)


def _wheel(rng: np.random.Generator) -> Link:
    """A rim with spokes and a knob on it."""
    radius, r, high = rng.uniform(0.025, 0.06), rng.uniform(0.004, 0.007), rng.uniform(0.015, 0.035)
    spokes = int(rng.integers(2, 5))
    ends = [(radius * np.cos(a), radius * np.sin(a), high) for a in 2 * np.pi * np.arange(12) / 12]
    rim = [rod(ends[k], ends[(k + 1) % 12], r) for k in range(12)]
    bars = [rod((0, 0, high), ends[12 * k // spokes], r) for k in range(spokes)]
    knob, tall = rng.uniform(0.006, 0.011), rng.uniform(0.02, 0.035)
    handle = disc(knob, high, high + tall).moved(up(x=radius))
    T = grip(np.eye(3)[1] if rng.random() < 0.5 else np.eye(3)[0], -_OUT, (radius, 0, high + 0.65 * tall))
    hub = disc(rng.uniform(0.006, 0.012), 0.001, high + 0.004)
    turn = rng.uniform(0.6, 2.0) * rng.choice((-1.0, 1.0))
    return Link((hub, *rim, *bars, handle), _OUT, np.zeros(3), True, (0.0, turn), T, 2 * knob)


def _flap(rng: np.random.Generator) -> Link:
    """A board hinged along one edge, lying on the face, with a knob or a bow near the other edge."""
    long, half, t = rng.uniform(0.03, 0.075), rng.uniform(0.015, 0.05), rng.uniform(0.003, 0.006)
    board = slab((0, -half, 0.002), (long, half, 0.002 + 2 * t))
    at, aside, tall = rng.uniform(0.7, 0.9) * long, rng.uniform(-0.4, 0.4) * half, rng.uniform(0.018, 0.03)
    r = rng.uniform(0.004, 0.008)
    knob = disc(r, 2 * t, 2 * t + tall, r * rng.uniform(0.8, 1.4)).moved(up(at, aside))
    width = 2.8 * r
    if rng.random() < 0.4:
        half_bow = np.array([min(half, rng.uniform(0.015, 0.03)), 0.004, tall / 2])
        turn = se3.make(se3.euler(z=np.pi / 2), (at, 0, 2 * t + tall / 2))
        knob, width, aside = Piece("bow", half_bow, turn), 0.008, 0.0
    closing = np.eye(3)[0] if knob.kind == "bow" else np.eye(3)[int(rng.integers(2))]
    T = grip(closing, -_OUT, (at, aside, 2 * t + tall - 0.005))
    pin = rod((-0.002, -half, 0.004), (-0.002, half, 0.004), 0.005)
    limit = rng.uniform(0.6, 1.8)
    return Link(
        (board, knob),
        np.array([0.0, -1.0, 0.0]),
        np.array([0, 0, 0.003]),
        True,
        (0.0, limit),
        T,
        width,
        (pin,),
    )


def _toggle(rng: np.random.Generator) -> Link:
    """A stick that stands out of the face and tips about an axis in it."""
    long, r = rng.uniform(0.03, 0.1), rng.uniform(0.004, 0.009)
    pieces = [rod((0, 0, 0), (0, 0, long), r)]
    width = 2 * r
    if rng.random() < 0.6:
        width = 2 * rng.uniform(r, 0.016)
        wide = rng.uniform(0.008, 0.03)
        pieces.append(slab((-wide, -width / 2, long - 0.012), (wide, width / 2, long + 0.008)))
    tip, turn = rng.uniform(-0.9, -0.2), rng.uniform(0.5, 1.5)
    T = grip(np.eye(3)[1], -_OUT, (0, 0, long - 0.004))
    axis = np.eye(3)[int(rng.integers(2))]
    link = Link(tuple(pieces), axis, np.zeros(3), True, (tip, tip + turn), T, width)
    return link


def _slider(rng: np.random.Generator) -> Link:
    """A rider on a rail."""
    travel, tall = rng.uniform(0.04, 0.1), rng.uniform(0.025, 0.05)
    rail = slab((-0.01, -0.006, -0.001), (travel + 0.01, 0.006, 0.006))
    half, wide = rng.uniform(0.006, 0.014), rng.uniform(0.006, 0.016)
    rider = slab((-half, -wide, 0.004), (half, wide, tall))
    if rng.random() < 0.4:
        rider = disc(wide, 0.004, tall, wide * rng.uniform(0.6, 1.2))
        half = wide
    closing, width = (np.eye(3)[0], 2 * half) if rng.random() < 0.5 else (np.eye(3)[1], 2 * wide)
    T = grip(closing, -_OUT, (0, 0, tall - 0.01))
    return Link((rider,), np.eye(3)[0], np.zeros(3), False, (0.0, travel), T, width, (rail,))


def _plunger(rng: np.random.Generator) -> Link:
    """A knob that is pulled out, or a cap that is pressed."""
    r, travel = rng.uniform(0.008, 0.022), rng.uniform(0.01, 0.03)
    if rng.random() < 0.4:
        cap = disc(r, -0.01, travel + 0.004, sides=int(rng.choice((4, 6, 20))))
        T = grip(np.eye(3)[1], -_OUT, (0, 0, travel + 0.004))
        return Link((cap,), -_OUT, np.zeros(3), False, (0.0, travel), T, 0.0)
    stem = rod((0, 0, -0.04), (0, 0, 0.01), 0.005)
    high, size = rng.uniform(0.015, 0.03), rng.uniform(0.006, 0.015)
    head = slab((-r, -size, 0.008), (r, size, 0.008 + high))
    T = grip(np.eye(3)[1], -_OUT, (0, 0, high - 0.004))
    return Link((stem, head), _OUT, np.zeros(3), False, (0.0, 2 * travel), T, 2 * size)


LINKS: tuple[Callable[[np.random.Generator], Link], ...] = (
    _crank,
    _wheel,
    _flap,
    _toggle,
    _slider,
    _plunger,
)
"""Every kind of link: draws one in a frame on the surface of a base, z outwards."""
