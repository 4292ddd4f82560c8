"""Toys that a hand takes from above: a brick, a car, a duck, a pawn."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from imop.sim.parts import lathe
from imop.sim.parts.shapes import PLASTIC, Color, box, part, rgba


@dataclass(frozen=True)
class Toy:
    """A kind of toy; lengths are multiples of its size.

    Attributes:
        name: of the kind.
        grasp: how high above its base the fingers take it.
        reach: of its outline from the middle.
        add: draws it on (spec, body, size, main colour, other colour), with the middle of its base at the
            origin of a frame that is `grasp` above it.
    """

    name: str
    grasp: float
    reach: float
    add: Callable[[Any, Any, float, Color, Color], None]


def toy(kind: Toy, size: float, color: Color, other_color: Color) -> Any:
    """A toy that moves freely; frame: in its middle where fingers take it, which close along y."""
    spec, body = part()
    kind.add(spec, body, size, color, other_color)
    return spec


def _brick(spec: Any, body: Any, s: float, color: Color, other: Color) -> None:
    low, top = -0.4 * s, 0.25 * s
    box(body, (-0.7 * s, -0.4 * s, low), (0.7 * s, 0.4 * s, top), color, PLASTIC)
    for x in (-0.35 * s, 0.35 * s):
        _can(body, (x, 0.0, top + 0.06 * s), 0.22 * s, 0.06 * s, other)


def _car(spec: Any, body: Any, s: float, color: Color, other: Color) -> None:
    low = -0.45 * s
    box(body, (-0.85 * s, -0.36 * s, low + 0.15 * s), (0.85 * s, 0.36 * s, low + 0.55 * s), color, PLASTIC)
    box(body, (-0.5 * s, -0.32 * s, low + 0.55 * s), (0.3 * s, 0.32 * s, low + 0.9 * s), other, PLASTIC)
    for x in (-0.5 * s, 0.5 * s):
        for y in (-0.38 * s, 0.38 * s):
            _can(body, (x, y, low + 0.2 * s), 0.2 * s, 0.06 * s, (0.1, 0.1, 0.1), lying=True)


def _duck(spec: Any, body: Any, s: float, color: Color, other: Color) -> None:
    low = -0.4 * s
    angle = np.linspace(-np.pi / 3, np.pi / 2, 6)
    profile = [(0.45 * s * np.cos(a), low + 0.45 * s * (np.sin(a) + np.sin(np.pi / 3))) for a in angle]
    lathe.solid(spec, body, "trunk", profile, color, PLASTIC, segments=16)
    head = np.array([0.28 * s, 0.0, low + 0.95 * s])
    _ball(body, head, 0.27 * s, color)
    low_bill, high_bill = np.array([(0.2, -0.1, -0.08), (0.42, 0.1, 0.04)]) * s + head
    box(body, low_bill, high_bill, other, PLASTIC)
    box(body, (-0.65 * s, -0.12 * s, low + 0.4 * s), (-0.3 * s, 0.12 * s, low + 0.6 * s), color, PLASTIC)


def _pawn(spec: Any, body: Any, s: float, color: Color, other: Color) -> None:
    low = -1.1 * s
    foot = [(0.42 * s, low), (0.42 * s, low + 0.2 * s), (0.2 * s, low + 0.85 * s)]
    lathe.solid(spec, body, "foot", foot, color, PLASTIC, segments=16)
    _ball(body, (0.0, 0.0, 0.0), 0.32 * s, other)


def _ball(body: Any, centre: Any, radius: float, color: Color) -> None:
    sphere = mujoco.mjtGeom.mjGEOM_SPHERE
    body.add_geom(type=sphere, pos=centre, size=[radius, 0, 0], rgba=rgba(color), density=PLASTIC)


def _can(body: Any, centre: Any, radius: float, half: float, color: Color, lying: bool = False) -> None:
    """A cylinder about z, or about y if it is `lying`."""
    turned = [np.sqrt(0.5), np.sqrt(0.5), 0, 0] if lying else [1, 0, 0, 0]
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        pos=centre,
        quat=turned,
        size=[radius, half, 0],
        rgba=rgba(color),
        density=PLASTIC,
    )


TOYS = (
    Toy("brick", 0.4, 0.75, _brick),
    Toy("car", 0.45, 0.9, _car),
    Toy("duck", 0.4, 0.75, _duck),
    Toy("pawn", 1.1, 0.45, _pawn),
)
