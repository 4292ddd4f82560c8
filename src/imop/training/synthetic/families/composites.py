"""Random rigid things, glued of a few primitives: nobody's household thing, but as large and as irregular."""

from collections.abc import Sequence

import numpy as np

from imop.geometry import se3
from imop.sim.parts.shapes import part
from imop.training.synthetic.families.primitives import (
    WALL,
    Piece,
    above_table,
    ambiguous,
    fits,
    holds,
    palette,
)
from imop.training.synthetic.families.thing import Hold, Thing, from_above, up
from imop.types import FloatArray

_MOST_PIECES = 6
_SMALLEST, _LARGEST = 0.05, 0.25
_TILTED = 0.25
_SIDES = np.stack([se3.euler(**{axis: turn * np.pi / 2}) for axis in "xy" for turn in (1, -1)])


def composite(shape: np.random.Generator, color: np.random.Generator) -> Thing:
    """Two to six primitives, each on a side of an earlier one; frame: on the table, x along the first one."""
    while True:
        pieces = set_down(shape, glued(shape))
        points = np.concatenate([piece.points() for piece in pieces] or [np.zeros((1, 3))])
        if not _SMALLEST < np.ptp(points, axis=0).max() < _LARGEST:
            continue
        grips = [hold for piece in pieces for hold in holds(shape, piece, points)]
        if grips and not ambiguous(points):
            break
    spec, body = part(fixed=True)
    paint = palette(color)
    for k, piece in enumerate(pieces):
        piece.add(spec, body, f"piece{k}", paint())
    chosen = shape.permutation(len(grips))[:4]
    tool = _tip(shape, pieces) if shape.random() < 0.5 else None
    return Thing(
        spec,
        tuple(grips[i] for i in chosen),
        pokes=_pokes(shape, pieces, points),
        spots=_spots(shape, pieces, points),
        rests=_rests(points, [grips[i] for i in chosen]),
        tool=tool,
    )


def glued(rng: np.random.Generator) -> list[Piece]:
    """Pieces that touch, each on a side of an earlier one or of its mirror image."""
    count = int(rng.integers(2, _MOST_PIECES + 1))
    first = primitive(rng)
    if rng.random() < 0.3 and first.kind in ("rod", "turned", "bow"):
        first = first.at(se3.make(se3.euler(y=np.pi / 2)))
    pieces = [first]
    while len(pieces) < count:
        parent = pieces[int(rng.integers(len(pieces)))] if rng.random() < 0.6 else first
        child = joined(rng, parent, primitive(rng))
        pieces.append(child)
        if rng.random() < 0.45 and _central(parent) and abs(child.T[1, 3]) > 0.005:
            pieces.append(child.mirrored())
    return pieces[:_MOST_PIECES]


def set_down(rng: np.random.Generator, pieces: list[Piece]) -> list[Piece]:
    """The pieces on the table at z = 0, on a side on which they stand; none if there is no such side."""
    points = np.concatenate([piece.points() for piece in pieces])
    sides = [np.eye(3), *_SIDES[rng.permutation(len(_SIDES))]]
    for R in sides:
        if stands(points @ R.T):
            T = se3.make(R, (0, 0, -float((points @ R.T)[:, 2].min())))
            return [piece.moved(T) for piece in pieces]
    return []


def _central(piece: Piece) -> bool:
    """Whether it is its own mirror image about the plane y = 0 of the body."""
    return abs(float(piece.T[1, 3])) < 1e-6 and abs(float(piece.T[1, 1])) > 0.9999


def primitive(rng: np.random.Generator) -> Piece:
    """A bar, a plate, a lump, a nub, something hollow or a bow, at the origin."""
    form = str(
        rng.choice(("bar", "plate", "lump", "nub", "hollow", "bow"), p=(0.3, 0.2, 0.2, 0.12, 0.08, 0.1))
    )
    if form == "bow":
        r = rng.uniform(0.004, 0.008)
        return Piece("bow", np.array([rng.uniform(0.02, 0.06), r, rng.uniform(0.016, 0.035)]), np.eye(4))
    kind = str(rng.choice(("box", "round", "prism"), p=(0.45, 0.4, 0.15)))
    if form == "hollow":
        half = rng.uniform((0.02, 0.02, 0.012), (0.06, 0.05, 0.045))
        return _cup(rng, half) if rng.random() < 0.5 else Piece("tub", half, np.eye(4))
    if form == "bar":
        half = np.array([*rng.uniform(0.005, 0.014, 2), rng.uniform(0.03, 0.09)])
        if kind == "round" and rng.random() < 0.5:
            return Piece("rod", half[[0, 0, 2]], np.eye(4))
    elif form == "plate":
        half = np.array([*rng.uniform(0.015, 0.065, 2), rng.uniform(0.003, 0.009)])
    elif form == "lump":
        half = rng.uniform(0.015, 0.042, 3)
    else:
        half = np.array([*rng.uniform(0.006, 0.013, 2), rng.uniform(0.006, 0.014)])
    if kind == "box":
        turned = np.eye(4) if rng.random() < 0.5 else se3.make(se3.euler(y=np.pi / 2))
        return Piece("box", half if rng.random() < 0.5 else half[[2, 1, 0]], turned)
    return _turned(rng, float(half[0]), float(half[2]), kind == "prism")


def _turned(rng: np.random.Generator, radius: float, h: float, prism: bool) -> Piece:
    style = rng.random()
    profile: tuple[tuple[float, float], ...] = ((radius, -h), (radius, h))
    if style < 0.3:
        profile = ((radius, -h), (radius * rng.uniform(0.2, 0.8), h))
    elif style < 0.5 and not prism:
        waist = rng.uniform(-0.4, 0.4) * h
        profile = ((radius * rng.uniform(0.3, 0.9), -h), (radius, waist), (radius * rng.uniform(0.3, 0.9), h))
    sides = int(rng.choice((3, 5, 6, 8))) if prism else 20
    return Piece("turned", np.array([radius, radius, h]), np.eye(4), profile, sides)


def _cup(rng: np.random.Generator, half: FloatArray) -> Piece:
    low, h = float(half[0] * rng.uniform(0.6, 1.0)), float(half[2])
    profile = ((low, -h), (float(half[0]), h))
    return Piece("cup", half[[0, 0, 2]], np.eye(4), profile, 14)


def joined(rng: np.random.Generator, parent: Piece, child: Piece) -> Piece:
    """The child on a side, face or end of the parent, standing, lying or leaning."""
    T = parent.T @ _face(rng, parent)
    turn = se3.euler(z=rng.choice((0.0, 0.5)) * np.pi)
    if child.kind not in ("bow", "cup", "tub") and rng.random() < 0.55:
        turn = turn @ se3.euler(y=np.pi / 2)
    lean = 0.0
    if child.kind not in ("bow", "cup", "tub") and rng.random() < _TILTED:
        lean = rng.uniform(0.2, 1.0) * rng.choice((-1.0, 1.0))
    seated = child.at(T @ se3.make(turn @ se3.euler(y=lean)))
    out = T[:3, 2]
    into = 0.003 + 0.6 * abs(np.sin(lean)) * float(child.half.min())
    along = 0.0
    if rng.random() < 0.4:
        along = rng.uniform(-0.7, 0.7) * seated.reach(T[:3, 0])
    return seated.at(se3.make(p=(seated.reach(-out) - into) * out + along * T[:3, 0]) @ seated.T)


def _face(rng: np.random.Generator, parent: Piece) -> FloatArray:
    """T_piece_face (4, 4): a point of its surface, z outwards."""
    z = float(parent.half[2])
    if parent.kind in ("box", "tub"):
        axis, sign = int(rng.integers(3)), float(rng.choice((-1.0, 1.0)))
        if parent.kind == "tub" and axis == 2:
            sign = -1.0
        p = np.array([_spot(rng) for _ in range(3)]) * parent.half
        p[axis] = sign * parent.half[axis]
        others = [np.eye(3)[i] for i in range(3) if i != axis]
        first = others[int(rng.integers(2))]
        out = sign * np.eye(3)[axis]
        return se3.make(np.stack([first, np.cross(out, first), out], axis=1), p)
    if parent.kind == "bow":
        return se3.make(p=(0, 0, z - 0.001))
    if rng.random() < 0.4:
        end = -1.0 if parent.kind == "cup" else float(rng.choice((-1.0, 1.0)))
        return se3.make(se3.euler(x=0.0 if end > 0 else np.pi), (0, 0, end * z))
    angle = float(rng.integers(8)) * np.pi / 4
    height = 0.85 * _spot(rng) * z
    r = parent.radius(height) * np.cos(np.pi / parent.sides)
    out = se3.euler(z=angle) @ np.array([1.0, 0, 0])
    first = np.array([0.0, 0, 1.0])
    return se3.make(np.stack([first, np.cross(out, first), out], axis=1), (*(r * out[:2]), height))


def _spot(rng: np.random.Generator) -> float:
    """Where on a side, -1 .. 1: in the middle, at an edge, anywhere."""
    kind = rng.random()
    return 0.0 if kind < 0.4 else float(rng.choice((-0.85, 0.85))) if kind < 0.65 else rng.uniform(-0.8, 0.8)


def stands(points: FloatArray) -> bool:
    """Whether the middle of a thing is above what it touches the table with."""
    middle = points.mean(axis=0)
    low = points[points[:, 2] < points[:, 2].min() + 0.005][:, :2]
    spans = np.ptp(low, axis=0)
    inside = (low.min(axis=0) + 0.1 * spans < middle[:2]) & (middle[:2] < low.max(axis=0) - 0.1 * spans)
    return bool(inside.all() and spans.min() > max(0.01, 0.15 * np.ptp(points[:, 2])))


def _rests(points: FloatArray, grips: Sequence[Hold]) -> tuple[FloatArray, ...]:
    """Upright, and on other sides where it stands and can be taken as well."""
    found = [np.eye(3)]
    for R in _SIDES:
        turned = points @ R.T
        T = se3.make(R, (0, 0, -float(turned[:, 2].min())))
        lying = se3.apply(T, points)
        if stands(lying) and all(
            above_table(T @ grip.T_link_gripper) and (T @ grip.T_link_gripper)[2, 2] < 0.15 for grip in grips
        ):
            found.append(R)
    return tuple(found)


def _free_above(p: FloatArray, points: FloatArray) -> bool:
    near = np.linalg.norm(points[:, :2] - p[:2], axis=1) < 0.015
    return not (points[near, 2] > p[2] + 0.004).any()


def _tops(pieces: Sequence[Piece], points: FloatArray) -> list[FloatArray]:
    """(3,) points on upper sides with nothing above, and on the floors of what is open above."""
    up_, found = np.array([0.0, 0.0, 1.0]), []
    for piece in pieces:
        top = piece.T[:3, 3] + piece.reach(up_) * up_
        if piece.kind in ("tub", "cup"):
            if piece.T[2, 2] > 0.99:
                found.append(top - (0, 0, 2 * float(piece.half[2]) - WALL))
        elif piece.kind != "bow" and np.abs(piece.T[2, :3]).max() > 0.99 and _free_above(top, points):
            found.append(top)
    return found


def _spots(rng: np.random.Generator, pieces: Sequence[Piece], points: FloatArray) -> tuple[FloatArray, ...]:
    tops = _tops(pieces, points)
    return tuple(up(*tops[i]) for i in rng.permutation(len(tops))[:2])


def _pokes(rng: np.random.Generator, pieces: Sequence[Piece], points: FloatArray) -> tuple[Hold, ...]:
    """Closed fingers from above, on up to two places."""
    found = []
    for top in _tops(pieces, points):
        T = from_above((top[0], top[1], top[2]), rng.uniform(-np.pi, np.pi), rng.uniform(-0.4, 0.4))
        if above_table(T) and fits(T, 0.0, points[np.linalg.norm(points - top, axis=1) > 0.03]):
            found.append(Hold(T, width=0.0))
    return tuple(found[i] for i in rng.permutation(len(found))[:2])


def _tip(rng: np.random.Generator, pieces: Sequence[Piece]) -> FloatArray:
    """T_body_tip (4, 4): the end of one of the last pieces."""
    piece = pieces[-1 - int(rng.integers(min(2, len(pieces))))]
    out = piece.T[:3, 2] * (1.0 if rng.random() < 0.5 else -1.0)
    if out[2] < -0.9:
        out = -out
    side = piece.T[:3, 0]
    R = np.stack([side, np.cross(out, side), out], axis=1)
    return se3.make(R, piece.T[:3, 3] + piece.reach(out) * out)
