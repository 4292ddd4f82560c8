"""What a family gives: a thing to look at, with the places where a gripper would act on it."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.parts.shapes import Color
from imop.types import FloatArray

TURNS = 12
"""A surface of revolution is right at this many turns about its axis."""


@dataclass(frozen=True, eq=False)
class Hold:
    """A gripper pose on a thing.

    Attributes:
        T_link_gripper: (4, 4); z approaches, y is the closing direction.
        link: body of the part.
        width: opening between the fingers when it is held, metres; 0 for closed fingers.
    """

    T_link_gripper: FloatArray
    link: str = "body"
    width: float = 0.02


@dataclass(frozen=True, eq=False)
class Moving:
    """A joint and how one moves it.

    Attributes:
        joint: its name; the link that it moves has the same name.
        positions: where it may stand, from shut to open; radians or metres.
        hold: where it is taken or pushed.
        push: True if closed fingers push it, False if it is held.
    """

    joint: str
    positions: tuple[float, float]
    hold: Hold
    push: bool = False


@dataclass(frozen=True, eq=False)
class Floor:
    """A level surface of a thing on which another one may lie anywhere.

    Attributes:
        middle: (3,) metres in the body's frame.
        half: half sizes along the body's x and y, metres.
    """

    middle: tuple[float, float, float]
    half: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Thing:
    """An object of a family.

    Attributes:
        part: MjSpec with the uppermost body "body".
        holds: where it is grasped to be carried; none if it is fixed or heavy.
        pokes: where closed fingers press on it along the gripper's z axis.
        spots: T_body_spot (4, 4) frames, z outwards, where something may be put down, in, over or on.
        mount: T_body_mount (4, 4): what comes to a spot; None is the middle of its underside.
        moving: its joints that one moves.
        bends: hinges that stand at random in every scene, as a rope's do.
        symmetry: (S, 4, 4) motions of the body's frame that change nothing that can be seen.
        rests: rotations (3, 3) in which it lies stably.
        tool: T_body_tip (4, 4) of its working end, z outwards, or None if it is no tool.
        keeps: T_body_keep (4, 4) frames, z up, to which the underside of what is held is brought and stays in
            the hand; it comes from +x, or from above.
        floors: where other things lie on it or in it.
        goals: T_body_goal (4, 4) frames, z up, to which something is pushed along +x.
        holes: T_body_hole (4, 4) frames, z outwards, at the bottom of holes in its upper side.
        row: whether its joints are equal to each other and differ in their places only.
        sided: whether it looks almost the same when it is turned, and where one acts tells its sides.
    """

    part: Any
    holds: tuple[Hold, ...] = ()
    pokes: tuple[Hold, ...] = ()
    spots: tuple[FloatArray, ...] = ()
    mount: FloatArray | None = None
    moving: tuple[Moving, ...] = ()
    bends: tuple[str, ...] = ()
    symmetry: FloatArray = field(default_factory=lambda: np.eye(4)[None])
    rests: tuple[FloatArray, ...] = (np.eye(3),)
    tool: FloatArray | None = None
    keeps: tuple[FloatArray, ...] = ()
    floors: tuple[Floor, ...] = ()
    goals: tuple[FloatArray, ...] = ()
    holes: tuple[FloatArray, ...] = ()
    row: bool = False
    sided: bool = False


Family = Callable[[np.random.Generator, np.random.Generator], Thing]
"""The first generator draws the shape, the second the colours."""


def revolution(turns: int = TURNS) -> FloatArray:
    """(turns, 4, 4) turns about the z axis of the body."""
    return np.stack([se3.make(se3.euler(z=2 * np.pi * k / turns)) for k in range(turns)])


def from_above(p: tuple[float, float, float], yaw: float = 0.0, lean: float = 0.0) -> FloatArray:
    """T_link_gripper (4, 4) straight down at `p`, closing along y turned by `yaw`, tipped by `lean`."""
    return se3.make(se3.euler(z=yaw) @ np.diag([-1.0, 1.0, -1.0]) @ se3.euler(y=lean), p)


def from_side(p: tuple[float, float, float], yaw: float = 0.0, down: float = 0.0) -> FloatArray:
    """T_link_gripper (4, 4) that approaches along -x turned by `yaw`, tipped `down`, closing level."""
    z = np.array([-np.cos(down), 0.0, -np.sin(down)])
    y = np.array([0.0, 1.0, 0.0])
    return se3.make(se3.euler(z=yaw) @ np.stack([np.cross(y, z), y, z], axis=1), p)


def from_front(p: tuple[float, float, float], down: float = 0.0) -> FloatArray:
    """T_link_gripper (4, 4) that approaches along -x, tipped `down`, closing upright."""
    return from_side(p, 0.0, down) @ se3.make(se3.euler(z=np.pi / 2))


def up(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> FloatArray:
    """A frame (4, 4) at a point of the body, z up."""
    return se3.make(p=(x, y, z))


_NAMED: tuple[Color, ...] = (
    (1, 0, 0),
    (0, 0.8, 0),
    (0, 0, 1),
    (1, 1, 0),
    (0, 1, 1),
    (1, 0, 1),
    (1, 0.5, 0),
    (0.5, 0, 0.5),
    (0, 0.5, 0.5),
    (0.95, 0.95, 0.95),
    (0.1, 0.1, 0.1),
    (0.6, 0.6, 0.62),
    (0.55, 0.35, 0.2),
)


def paint(rng: np.random.Generator) -> Color:
    """A pure colour with a name, a grey, or any."""
    kind = rng.random()
    if kind < 0.4:
        return _NAMED[int(rng.integers(len(_NAMED)))]
    if kind < 0.55:
        grey = rng.uniform(0.1, 0.95)
        return tuple(np.clip(grey + rng.uniform(-0.04, 0.04, 3), 0, 1).tolist())
    return tuple(rng.uniform(0.05, 0.95, 3).tolist())
