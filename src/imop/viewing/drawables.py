"""Shapes to be drawn, without anybody who draws them. Positions are metres, colours 0 .. 1."""

from dataclasses import dataclass

import numpy as np

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.types import FloatArray, as_array, as_finite, as_pose

Color = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Points:
    """A cloud.

    Attributes:
        name: what it is, its parts parted by "/".
        points: (N, 3).
        colors: (N, 3) red, green, blue.
        size: of a point, metres.
    """

    name: str
    points: FloatArray
    colors: FloatArray
    size: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", as_finite("points", self.points, (None, 3)))
        colors = as_array("colors", self.colors, (len(self.points), 3))
        if colors.size and not (colors.min() >= 0 and colors.max() <= 1):
            raise InvalidInput("colors", f"{colors.min()} .. {colors.max()}", "0 .. 1")
        object.__setattr__(self, "colors", colors)


@dataclass(frozen=True, eq=False)
class Lines:
    """Line segments of one colour.

    Attributes:
        name: what they are.
        ends: (N, 2, 3).
        color: of all.
        width: pixels.
    """

    name: str
    ends: FloatArray
    color: Color
    width: float = 1.5

    def __post_init__(self) -> None:
        object.__setattr__(self, "ends", as_finite("ends", self.ends, (None, 2, 3)))


@dataclass(frozen=True, eq=False)
class Path:
    """A line from point to point.

    Attributes:
        name: what it is.
        points: (K, 3), at least two.
        color: of the line.
        width: pixels.
    """

    name: str
    points: FloatArray
    color: Color
    width: float = 3.0

    def __post_init__(self) -> None:
        points = as_finite("points", self.points, (None, 3))
        if len(points) < 2:
            raise InvalidInput("points", f"{len(points)}", "at least two")
        object.__setattr__(self, "points", points)


@dataclass(frozen=True, eq=False)
class Gripper:
    """A gripper with two fingers.

    Attributes:
        name: what it is.
        T: (4, 4) pose of the gripper frame as it is drawn.
        opening: 0 closed .. 1 open.
        color: of its lines.
        width: pixels.
    """

    name: str
    T: FloatArray
    opening: float
    color: Color
    width: float = 4.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "T", as_pose("T", self.T))
        if not 0 <= self.opening <= 1:
            raise InvalidInput("opening", f"{self.opening}", "0 closed .. 1 open")

    @property
    def ends(self) -> FloatArray:
        """(N, 2, 3) the line segments that it is drawn with."""
        y = 0.006 + 0.034 * self.opening
        fingers = [[[0, s * y, 0.0], [0, s * y, -0.05]] for s in (-1, 1)]
        hand = [[[0, -0.045, -0.05], [0, 0.045, -0.05]], [[0, 0, -0.05], [0, 0, -0.11]]]
        return se3.apply(self.T, np.reshape(fingers + hand, (-1, 3))).reshape(-1, 2, 3)


@dataclass(frozen=True, eq=False)
class Label:
    """Words at a place.

    Attributes:
        name: what they are about.
        text: one line.
        p: (3,) where its lower edge is centred.
        scale: 1 for words beside things, more for titles.
    """

    name: str
    text: str
    p: FloatArray
    scale: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "p", as_finite("p", self.p, (3,)))


Drawable = Points | Lines | Path | Gripper | Label
