"""Random machines: a base with one to three links on hinges and slides, alike, mirror images or different."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from imop.geometry import se3
from imop.geometry.neighbours import within
from imop.sim.parts.hinge import hinge
from imop.sim.parts.shapes import part
from imop.training.families.composites import primitive
from imop.training.families.primitives import (
    Piece,
    above_table,
    ambiguous,
    disc,
    fits,
    grip,
    mirrored,
    palette,
    rod,
    slab,
)
from imop.training.families.thing import Hold, Moving, Thing, up
from imop.types import FloatArray

_APART = 0.004
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


def mechanism(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """A base and its links; frame: on the table, most links towards +x or upwards."""
    count = int(shape.choice((1, 2, 3), p=(0.4, 0.4, 0.2)))
    while True:
        base, faces = _base(shape)
        links = _links(shape, faces, count)
        base += [piece for link in links for piece in link.fixed]
        base += _marks(shape, faces)
        if _works(base, links):
            break
    spec, body = part(fixed=True)
    paint = palette(color)
    for k, piece in enumerate(base):
        piece.add(spec, body, f"piece{k}", paint())
    moving: list[Moving] = []
    for k, link in enumerate(links):
        moving += _hang(spec, body, link, f"link{k}", paint, shape.random() < 0.5)
    top = max(base, key=lambda piece: float(piece.T[2, 3]) + piece.reach(_OUT))
    spot = up(float(top.T[0, 3]), float(top.T[1, 3]), float(top.T[2, 3]) + top.reach(_OUT))
    return Thing(spec, spots=(spot,) if shape.random() < 0.5 else (), moving=tuple(moving))


def _hang(spec: Any, body: Any, link: Link, name: str, paint: Callable[[], Any], back: bool) -> list[Moving]:
    """Add a link to the part; it may be moved to and fro if `back` and it is held."""
    child = body.add_body(name=name, pos=link.at)
    if link.turns:
        hinge(child, name, link.axis.tolist(), (-np.pi, np.pi))
    else:
        child.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=link.axis.tolist())
    T_link_body = se3.make(p=-link.at)
    for k, piece in enumerate(link.pieces):
        piece.moved(T_link_body).add(spec, child, f"{name} piece{k}", paint())
    hold = Hold(T_link_body @ link.T, name, link.width)
    found = [Moving(name, link.positions, hold, push=link.width == 0.0)]
    if back and link.width > 0.0:
        found.append(Moving(name, link.positions[::-1], hold))
    return found


def _works(base: Sequence[Piece], links: Sequence[Link]) -> bool:
    """Whether nothing collides, all can be held, and the whole has no symmetry."""
    for link in links:
        holds = [link.motion(position) @ link.T for position in link.positions]
        if link.T[2, 2] > 0.2 or not all(above_table(T) for T in holds):
            return False
    still = np.concatenate([piece.points() for piece in base])
    shown = [link.points() for link in links]
    everything = np.concatenate([still, *shown])
    for k, link in enumerate(links):
        if not fits(link.T, link.width, everything):
            return False
        others = [points for other, points in enumerate(shown) if other != k]
        if others and within(shown[k], np.concatenate(others), _APART).any():
            return False
        moved = se3.apply(link.motion(link.positions[1]), shown[k])
        if moved[:, 2].min() < 0.001 or within(moved, np.concatenate([still, *others]), 0.003).mean() > 0.25:
            return False
    return not ambiguous(everything)


Face = tuple[FloatArray, float, float]
"""T_body_face (4, 4), z outwards, and its half sizes along x and y, metres."""


def _base(rng: np.random.Generator) -> tuple[list[Piece], list[Face]]:
    """The fixed part, and the faces where links may be: the upper one first, then +x, +y."""
    kind = str(rng.choice(("box", "slab", "board", "open", "ring", "post", "column")))
    x, y, z = rng.uniform(0.03, 0.09), rng.uniform(0.04, 0.12), rng.uniform(0.04, 0.16)
    if kind == "slab":
        z = rng.uniform(0.01, 0.03)
    if kind == "board":
        x, z = rng.uniform(0.01, 0.025), rng.uniform(0.1, 0.22)
    if kind == "post":
        x = y = rng.uniform(0.012, 0.03)
        z = rng.uniform(0.1, 0.24)
    top = (up(z=z), x, y)
    front = (_facing((x, 0, z / 2), (1, 0, 0)), y, z / 2)
    side = (_facing((0, y, z / 2), (0, 1, 0)), x, z / 2)
    if kind == "column":
        r = max(0.03, min(x, y))
        sides = int(rng.choice((5, 6, 8, 20)))
        return [disc(r, 0, z, rng.uniform(0.6, 1.0) * r, sides)], [(up(z=z), 0.5 * r, 0.5 * r)]
    if kind == "ring":
        half = np.array([y, y, z / 2])
        cup = Piece("cup", half, up(z=z / 2), ((y, -z / 2), (y * rng.uniform(0.8, 1.0), z / 2)), 14)
        post = disc(0.4 * y, 0.003, 1.05 * z)
        return [cup, post], [(up(z=1.05 * z), 0.25 * y, 0.25 * y)]
    if kind == "open":
        t = 0.008
        boards = [
            slab((-x, -y, 0), (x, y, t)),
            slab((-x, -y, z - t), (x, y, z)),
            slab((-x, -y, t), (t - x, y, z - t)),
        ]
        walls = [slab((-x, y - t, t), (x, y, z - t))]
        return boards + walls + [walls[0].mirrored()], [top, side]
    pieces = [slab((-x, -y, 0), (x, y, z))]
    if kind in ("board", "post"):
        foot = x + rng.uniform(0.02, 0.05)
        pieces.append(slab((-foot, -y - 0.01, 0), (foot, y + 0.01, 0.01)))
    return pieces, [top, front, side] if kind != "slab" else [top]


def _facing(p: tuple[float, float, float], out: tuple[int, int, int]) -> FloatArray:
    """A frame at `p` with z along `out`, which is level, and y upwards."""
    z, y = np.array(out, dtype=float), _OUT
    return se3.make(np.stack([np.cross(y, z), y, z], axis=1), p)


def _links(rng: np.random.Generator, faces: Sequence[Face], count: int) -> list[Link]:
    """Links somewhere on the faces, most of several alike."""
    links: list[Link] = []
    while len(links) < count:
        T, a, b = faces[int(rng.integers(len(faces)))] if rng.random() < 0.6 else faces[0]
        place = T @ up(rng.uniform(-0.8, 0.8) * a, rng.uniform(-0.8, 0.8) * b)
        pedestal = rng.random() < 0.35
        local = se3.make(se3.euler(z=float(rng.integers(4)) * np.pi / 2))
        stem: tuple[Piece, ...] = ()
        if pedestal:
            lean = se3.make(se3.euler(x=rng.uniform(-0.5, 0.5), y=rng.uniform(-0.5, 0.5)))
            high = rng.uniform(0.01, 0.04)
            stem = (disc(rng.uniform(0.008, 0.016), -0.008, high).moved(place @ lean),)
            local = lean @ up(z=high) @ local
        kind = _KINDS[int(rng.integers(len(_KINDS)))]
        link = kind(rng).moved(place @ local)
        link = replace(link, fixed=(*link.fixed, *stem))
        links.append(link)
        if len(links) < count and rng.random() < 0.8:
            if rng.random() < 0.7 and abs(place[1, 3]) > 0.012:
                links.append(link.mirrored())
            else:
                links.append(link.moved(se3.make(p=rng.uniform(-1.2, 1.2) * a * T[:3, 0])))
    return links


def _marks(rng: np.random.Generator, faces: Sequence[Face]) -> list[Piece]:
    """What tells the sides of a base apart: a mark, a bump, a bar, a screen, off the middle."""
    found = []
    for _ in range(int(rng.integers(1, 3))):
        T, a, b = faces[int(rng.integers(len(faces)))]
        at = T @ up(rng.uniform(-0.7, 0.7) * a, rng.uniform(-0.7, 0.7) * b)
        kind = rng.random()
        if kind < 0.35:
            u, v, high = (
                0.5 * rng.uniform(0.3, 1.0) * a,
                0.5 * rng.uniform(0.3, 1.0) * b,
                rng.uniform(0.001, 0.012),
            )
            found.append(slab((-u, -v, 0), (u, v, high)).moved(at))
        elif kind < 0.6:
            long, lean = rng.uniform(0.03, 0.1), rng.uniform(-1.2, 1.2)
            end = (long * np.sin(lean), 0.0, long * np.cos(lean))
            found.append(rod((0, 0, 0), end, rng.uniform(0.004, 0.011)).moved(at))
        else:
            piece = primitive(rng)
            found.append(piece.moved(at @ up(z=piece.reach(_OUT) - 0.002)))
    return found


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


_KINDS: tuple[Callable[[np.random.Generator], Link], ...] = (
    _crank,
    _wheel,
    _flap,
    _toggle,
    _slider,
    _plunger,
)
