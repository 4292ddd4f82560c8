"""Random machines: a base with one to three links on hinges and slides, alike, mirror images or different."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from imop.geometry import se3
from imop.geometry.neighbours import within
from imop.sim.parts.hinge import hinge
from imop.sim.parts.shapes import part
from imop.training.synthetic.families.composites import primitive
from imop.training.synthetic.families.links import LINKS, Link
from imop.training.synthetic.families.primitives import (
    Piece,
    above_table,
    ambiguous,
    disc,
    fits,
    palette,
    rod,
    slab,
)
from imop.training.synthetic.families.thing import Hold, Moving, Thing, up
from imop.types import FloatArray

_APART = 0.004
_OUT = np.array([0.0, 0.0, 1.0])


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
        kind = LINKS[int(rng.integers(len(LINKS)))]
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
