"""Primitives that random things are glued from: how they look, how far they reach, where fingers fit."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from imop.geometry import se3
from imop.sim.parts import lathe
from imop.sim.parts.shapes import PLASTIC, Color, box, capsule
from imop.training.synthetic.families.thing import Hold, paint
from imop.types import FloatArray

Kind = Literal["box", "tub", "rod", "turned", "cup", "bow"]

WALL = 0.004
"""Of tubs and cups, metres."""
_MIRROR = np.diag([1.0, -1.0, 1.0, 1.0])
_SPACING = 0.008
_WIDEST = 0.075
_WAYS = np.stack([se3.euler(z=k * np.pi / 6)[:, 0] for k in range(12)])
"""(12, 3) level directions all around."""

Grip = tuple[FloatArray, FloatArray, FloatArray, float]
"""Closing direction, approach and place (3,) of a gripper, in metres in the frame of a piece; its width."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A primitive; it is its own mirror image about its plane y = 0.

    Attributes:
        kind: a box; a tub (a box open at +z); a rod along z with round ends; a solid turned about z, or a
            prism; a cup (turned, open at +z); a bow that stands on two feet along x and is gripped at +z.
        half: (3,) half sizes of the box around it, metres.
        T: (4, 4) T_body_piece, its middle.
        profile: (radius, height above the middle) points from below, of what is turned and of cups.
        sides: of a prism; many look round.
    """

    kind: Kind
    half: FloatArray
    T: FloatArray
    profile: tuple[tuple[float, float], ...] = ()
    sides: int = 20

    def at(self, T: FloatArray) -> "Piece":
        """The same one elsewhere."""
        return replace(self, T=T)

    def moved(self, T: FloatArray) -> "Piece":
        """The same one after a motion (4, 4) of the body."""
        return replace(self, T=T @ self.T)

    def mirrored(self) -> "Piece":
        """Its mirror image about the plane y = 0 of the body."""
        return replace(self, T=mirrored(self.T))

    def radius(self, height: float) -> float:
        """Of what is round, at a height above its middle, metres."""
        if not self.profile:
            return float(self.half[0])
        return float(np.interp(height, [z for _, z in self.profile], [r for r, _ in self.profile]))

    def reach(self, way: FloatArray) -> float:
        """How far it extends from its middle along the direction `way` (3,) of the body, metres."""
        d = self.T[:3, :3].T @ way
        if self.profile:
            return max(r * float(np.hypot(d[0], d[1])) + z * float(d[2]) for r, z in self.profile)
        if self.kind == "rod":
            return float((self.half[2] - self.half[0]) * abs(d[2]) + self.half[0])
        return float(np.abs(d) @ self.half)

    def points(self) -> FloatArray:
        """(N, 3) points of its surface, about evenly spread, in the body's frame."""
        return se3.apply(self.T, self._points())

    def _points(self) -> FloatArray:
        if self.kind == "bow":
            return np.concatenate([_along(a, b) for a, b in pairwise(self._bow())])
        if self.kind in ("box", "tub"):
            steps = [np.linspace(-h, h, 2 + int(2 * h / _SPACING)) for h in self.half]
            grid = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3)
            near = np.isclose(np.abs(grid), self.half)
            shown = near[:, 0] | near[:, 1] | (near[:, 2] & ((grid[:, 2] < 0) | (self.kind == "box")))
            return np.asarray(grid[shown])
        r, _, h = self.half
        outline = np.array(self.profile or ((r, -h), (r, h)))
        caps = [outline[:1] * (share, 1) for share in (0.0, 0.5)]
        if self.kind != "cup":
            caps += [outline[-1:] * (share, 1) for share in (0.0, 0.5)]
        turned = np.concatenate([*caps, *(_along(a, b) for a, b in pairwise(outline))])
        ways = _WAYS[::2] if r < 0.012 else _WAYS
        around = np.einsum("n,wi->nwi", turned[:, 0], ways)
        around[:, :, 2] = turned[:, 1:]
        return np.asarray(around.reshape(-1, 3))

    def _bow(self) -> FloatArray:
        """(4, 3) corners of its middle line."""
        x, r, z = self.half[0] - self.half[1], self.half[1], self.half[2]
        return np.array([(-x, 0, -z), (-x, 0, z - r), (x, 0, z - r), (x, 0, -z)])

    def add(self, spec: Any, body: Any, name: str, color: Color) -> None:
        """Add it to a body of a part."""
        inner = body.add_body(name=name, pos=self.T[:3, 3], quat=se3.to_wxyz(self.T))
        x, y, z = self.half.tolist()
        if self.kind == "box":
            box(inner, (-x, -y, -z), (x, y, z), color, PLASTIC)
        elif self.kind == "tub":
            box(inner, (-x, -y, -z), (x, y, WALL - z), color, PLASTIC)
            for side in (-1, 1):
                a, b = sorted((side * x, side * (x - WALL)))
                box(inner, (a, -y, -z), (b, y, z), color, PLASTIC)
                a, b = sorted((side * y, side * (y - WALL)))
                box(inner, (-x, a, -z), (x, b, z), color, PLASTIC)
        elif self.kind == "rod":
            capsule(inner, (0, 0, x - z), (0, 0, z - x), x, color, PLASTIC)
        elif self.kind == "bow":
            for start, end in pairwise(self._bow().tolist()):
                capsule(inner, start, end, y, color, PLASTIC)
        elif self.kind == "turned":
            lathe.solid(spec, inner, name, self.profile, color, PLASTIC, self.sides)
        else:
            floor = [(self.profile[0][0], -z), (self.profile[0][0], WALL - z)]
            lathe.solid(spec, inner, f"{name} floor", floor, color, PLASTIC, self.sides)
            lathe.shell(spec, inner, name, self.profile, WALL, color, PLASTIC, self.sides)

    def grips(self) -> Iterator[Grip]:
        """Where two parallel fingers fit around it when it is alone, in its own frame."""
        axes = np.eye(3)
        _, y, z = self.half.tolist()
        if self.kind == "bow":
            yield axes[1], -axes[2], np.array((0, 0, z - y)), 2 * y
        elif self.kind in ("tub", "cup"):
            for way in (*axes[:2], *-axes[:2]):
                wall = self.profile[-1][0] if self.kind == "cup" else float(self.half @ np.abs(way))
                yield way, -axes[2], (wall - WALL / 2) * way + (0, 0, z - 0.012), WALL
        elif self.kind == "box":
            for a, b in ((a, b) for a in range(3) for b in range(3) if a != b):
                for way in (axes[b], -axes[b]):
                    deep = max(0.0, float(self.half[b]) - 0.02)
                    yield axes[a], -way, deep * way, 2 * float(self.half[a])
        else:
            yield from self._round_grips()

    def _round_grips(self) -> Iterator[Grip]:
        along, z = np.array([0.0, 0.0, 1.0]), float(self.half[2])
        for way, aside in zip(_WAYS, np.roll(_WAYS, -3, axis=0), strict=True):
            for height in (-0.5 * z, 0.0, 0.5 * z):
                yield aside, -way, height * along, 2 * self.radius(height)
            if z < 0.02:
                yield along, -way, max(0.0, self.radius(0.0) - 0.015) * way, 2 * z
            for sign in (-1.0, 1.0):
                height = sign * max(0.0, z - 0.015)
                yield aside, -sign * along, height * along, 2 * self.radius(height)


def mirrored(T: FloatArray) -> FloatArray:
    """The pose (4, 4) of the mirror image, about the plane y = 0, of what is symmetric about its own."""
    return np.asarray(_MIRROR @ T @ _MIRROR)


def grip(closing: FloatArray, approach: FloatArray, p: Sequence[float] | FloatArray) -> FloatArray:
    """T_body_gripper (4, 4) at `p`, from its directions in the body's frame."""
    return se3.make(np.stack([np.cross(closing, approach), closing, approach], axis=1), np.asarray(p))


def rod(start: Sequence[float], end: Sequence[float], radius: float) -> Piece:
    """A rod with round ends between two points."""
    a, b = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    z = (b - a) / np.linalg.norm(b - a)
    x = np.cross((0.0, 1.0, 0.0), z) if abs(z[1]) < 0.9 else np.cross((0.0, 0.0, 1.0), z)
    x /= np.linalg.norm(x)
    half = np.array([radius, radius, np.linalg.norm(b - a) / 2 + radius])
    return Piece("rod", half, se3.make(np.stack([x, np.cross(z, x), z], axis=1), (a + b) / 2))


def slab(lower: Sequence[float], upper: Sequence[float]) -> Piece:
    """The box between two corners."""
    low, high = np.asarray(lower, dtype=float), np.asarray(upper, dtype=float)
    return Piece("box", (high - low) / 2, se3.make(p=(low + high) / 2))


def disc(radius: float, low: float, high: float, top: float | None = None, sides: int = 20) -> Piece:
    """An upright cylinder about the z axis, or a cone with another radius on `top`, or a prism."""
    half = (high - low) / 2
    profile = ((radius, -half), (radius if top is None else top, half))
    wide = max(radius, profile[1][0])
    return Piece("turned", np.array([wide, wide, half]), se3.make(p=(0, 0, low + half)), profile, sides)


def _along(a: FloatArray, b: FloatArray) -> FloatArray:
    """(N, 3) points on a line."""
    return np.linspace(a, b, 2 + int(np.linalg.norm(b - a) / _SPACING))


_HAND = np.array([(x, y, z) for x in (-0.03, 0.03) for y in (-0.1, 0.1) for z in (-0.17, -0.05)])
_TIPS = np.array([(x, y, 0.008) for x in (-0.01, 0.01) for y in (-0.02, 0.02)])


def above_table(T_body_gripper: FloatArray) -> bool:
    """Whether hand and fingers stay above z = 0."""
    return bool(se3.apply(T_body_gripper, np.concatenate([_HAND, _TIPS]))[:, 2].min() > 0.001)


def fits(T_body_gripper: FloatArray, width: float, points: FloatArray) -> bool:
    """Whether fingers `width` metres apart, and the hand, have room among a thing's `points` (N, 3)."""
    x, y, z = se3.apply(se3.invert(T_body_gripper), points).T
    x, y = np.abs(x), np.abs(y)
    finger = (x < 0.011) & (z > -0.05) & (z < 0.008) & (y > width / 2 + 0.003) & (y < width / 2 + 0.02)
    hand = (x < 0.03) & (y < 0.1) & (z > -0.13) & (z < -0.052)
    return not (finger | hand).any()


def holds(rng: np.random.Generator, piece: Piece, points: FloatArray) -> list[Hold]:
    """Up to two grips of a piece, some leaning, with room above the table among a whole thing's `points`."""
    found: list[Hold] = []
    grips = [item for item in piece.grips() if item[3] <= _WIDEST and piece.T[2, :3] @ item[1] < 0.15]
    for closing, approach, p, width in (grips[i] for i in rng.permutation(len(grips))[:8]):
        if len(found) == 2:
            break
        lean = se3.make(se3.euler(y=rng.uniform(-0.7, 0.7) if rng.random() < 0.5 else 0.0))
        T = piece.T @ grip(closing, approach, p) @ lean
        if T[2, 2] < 0.15 and above_table(T) and fits(T, width, points):
            found.append(Hold(T, width=width))
    return found


def ambiguous(points: FloatArray) -> bool:
    """Whether some turn about an axis through its middle leaves almost all of a surface where it was."""
    some = points[np.random.default_rng(0).permutation(len(points))[:200]]
    middle = points.mean(axis=0)
    own = np.linalg.svd(some - middle, full_matrices=False)[2]
    turned = np.einsum("kij,nj->kni", _turns(np.concatenate([np.eye(3), own])), some - middle)
    near = np.isfinite(cKDTree(points - middle).query(turned, distance_upper_bound=0.01)[0])
    return bool(near.mean(axis=1).max() > 0.95)


def _turns(axes: FloatArray) -> FloatArray:
    """(K, 3, 3) turns about axes (N, 3) by 60, 90, 120 and 180 degrees; turning back tells no more."""
    return Rotation.from_rotvec([k * np.pi / 6 * axis for axis in axes for k in (2, 3, 4, 6)]).as_matrix()


def palette(color: np.random.Generator) -> Callable[[], Color]:
    """Draws from one to four colours, one after the other."""
    colors = [paint(color) for _ in range(int(color.integers(1, 5)))]
    return lambda: colors[int(color.integers(len(colors)))]
