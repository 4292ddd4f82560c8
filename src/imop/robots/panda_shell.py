"""The outer shape of the Panda as primitives, frame by frame.

Lengths in metres, in the link frames of the modified Denavit-Hartenberg convention. The dimensions are
measured on the published shape of the arm; the finger boxes are those of franka_description.
"""

import math
from dataclasses import dataclass
from typing import Literal

Vector = tuple[float, float, float]

WHITE = (0.92, 0.92, 0.92, 1.0)
BLACK = (0.22, 0.22, 0.22, 1.0)


@dataclass(frozen=True)
class Shell:
    """One primitive of a link.

    Attributes:
        kind: the shape.
        size: capsule and cylinder (radius, half length, 0); box and ellipsoid half extents.
        position: centre in the link frame.
        rpy: rotation about the fixed x, y, z axes of the link frame; the axis of capsules and cylinders is z.
        rgba: colour.
    """

    kind: Literal["capsule", "cylinder", "box", "ellipsoid"]
    size: Vector
    position: Vector = (0.0, 0.0, 0.0)
    rpy: Vector = (0.0, 0.0, 0.0)
    rgba: tuple[float, float, float, float] = WHITE


def _rod(kind: Literal["capsule", "cylinder"], radius: float, start: Vector, end: Vector) -> Shell:
    """A capsule or cylinder whose axis runs from `start` to `end`."""
    x, y, z = (b - a for a, b in zip(start, end, strict=True))
    length = math.sqrt(x * x + y * y + z * z)
    centre = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2, (start[2] + end[2]) / 2)
    return Shell(kind, (radius, length / 2, 0), centre, (0.0, math.acos(z / length), math.atan2(y, x)))


# The fingers move along y; this is the one on the +y side of the hand, the other is turned by 180 degrees.
_FINGER = (
    Shell("box", (0.0105, 0.0070, 0.0100), (0, 0.0184, 0.0100)),
    Shell("box", (0.0105, 0.0090, 0.0022), (0, 0.0115, 0.0022)),
    Shell("box", (0.0100, 0.0045, 0.0120), (0, 0.0159, 0.0283), (math.pi / 6, 0, 0)),
    Shell("box", (0.0090, 0.0072, 0.0084), (0, 0.0072, 0.0454), rgba=BLACK),
)

# Shoulder and upper arm are one shape used twice, and so are the two halves of the elbow: a cylinder that
# bends into another with a domed cap.
SHELLS: dict[str, tuple[Shell, ...]] = {
    "link0": (
        _rod("cylinder", 0.056, (0, 0, 0), (0, 0, 0.140)),
        Shell("box", (0.095, 0.080, 0.005), (-0.055, 0, 0.005)),
        Shell("box", (0.070, 0.074, 0.033), (-0.060, 0, 0.033)),
        Shell("box", (0.055, 0.060, 0.030), (-0.072, 0, 0.068), (0, -0.74, 0)),
        _rod("cylinder", 0.066, (0, 0, 0), (0, 0, 0.060)),
    ),
    "link1": (
        _rod("cylinder", 0.055, (0, 0, -0.192), (0, 0, -0.115)),
        Shell("ellipsoid", (0.055, 0.055, 0.036), (0, 0, -0.115)),
        _rod("capsule", 0.053, (0, -0.030, -0.090), (0, -0.050, -0.020)),
        _rod("cylinder", 0.055, (0, -0.001, 0), (0, -0.064, 0)),
        Shell("ellipsoid", (0.055, 0.0674, 0.055), (0, -0.062, 0)),
        _rod("cylinder", 0.043, (0, -0.060, 0), (0, -0.109, 0)),
    ),
    "link2": (
        _rod("cylinder", 0.055, (0, -0.194, 0), (0, -0.115, 0)),
        Shell("ellipsoid", (0.055, 0.036, 0.055), (0, -0.115, 0)),
        _rod("capsule", 0.053, (0, -0.090, 0.030), (0, -0.020, 0.050)),
        _rod("cylinder", 0.055, (0, 0, 0.001), (0, 0, 0.064)),
        Shell("ellipsoid", (0.055, 0.055, 0.0674), (0, 0, 0.062)),
        _rod("cylinder", 0.043, (0, 0, 0.060), (0, 0, 0.109)),
    ),
    "link3": (
        _rod("cylinder", 0.055, (0, 0, -0.121), (0, 0, -0.090)),
        Shell("ellipsoid", (0.0548, 0.0548, 0.079), (0, 0, -0.090)),
        _rod("cylinder", 0.044, (0, 0, -0.090), (0, 0, -0.025)),
        _rod("capsule", 0.040, (0.012, 0.020, -0.062), (0.065, 0.055, -0.022)),
        _rod("cylinder", 0.055, (0.0825, 0.001, 0), (0.0825, 0.068, 0)),
        Shell("ellipsoid", (0.055, 0.045, 0.055), (0.0825, 0.066, 0)),
        _rod("cylinder", 0.042, (0.0825, 0.060, 0), (0.0825, 0.097, 0)),
    ),
    "link4": (
        _rod("cylinder", 0.055, (-0.0825, 0.124, 0), (-0.0825, 0.090, 0)),
        Shell("ellipsoid", (0.0548, 0.079, 0.0548), (-0.0825, 0.090, 0)),
        _rod("cylinder", 0.044, (-0.0825, 0.090, 0), (-0.0825, 0.025, 0)),
        _rod("capsule", 0.040, (-0.0705, 0.062, 0.020), (-0.0175, 0.022, 0.055)),
        _rod("cylinder", 0.055, (0, 0, 0.001), (0, 0, 0.068)),
        Shell("ellipsoid", (0.055, 0.055, 0.045), (0, 0, 0.066)),
        _rod("cylinder", 0.042, (0, 0, 0.060), (0, 0, 0.097)),
    ),
    "link5": (
        _rod("cylinder", 0.055, (0, 0, -0.259), (0, 0, -0.225)),
        Shell("ellipsoid", (0.0548, 0.0548, 0.065), (0, 0, -0.228)),
        _rod("capsule", 0.044, (0, 0.015, -0.215), (0, 0.042, -0.185)),
        _rod("capsule", 0.026, (0.008, 0.045, -0.185), (0.007, 0.076, -0.145)),
        _rod("capsule", 0.026, (-0.008, 0.045, -0.185), (-0.007, 0.076, -0.145)),
        Shell("box", (0.029, 0.0200, 0.060), (0, 0.0880, -0.0990), (-0.17, 0, 0)),
        _rod("cylinder", 0.048, (0, 0.016, 0), (0, 0.085, 0)),
        Shell("ellipsoid", (0.0504, 0.045, 0.0515), (0, 0.085, 0)),
        _rod("capsule", 0.036, (0, 0.082, -0.050), (0, 0.090, -0.010)),
    ),
    "link6": (
        _rod("cylinder", 0.0478, (0, 0, -0.0148), (0, 0, 0.040)),
        _rod("cylinder", 0.0360, (0.006, 0, 0.035), (0.006, 0, 0.0545)),
        Shell("box", (0.030, 0.031, 0.0100), (0.026, 0, 0.0460)),
        Shell("box", (0.044, 0.044, 0.0290), (0.044, 0.003, 0.0140)),
        _rod("cylinder", 0.044, (0.088, -0.0512, 0), (0.088, 0.066, 0)),
        Shell("ellipsoid", (0.044, 0.0170, 0.044), (0.086, 0.0645, 0)),
        Shell("box", (0.020, 0.020, 0.0280), (0.060, 0.050, 0.0080), (0, 0, 0.55)),
    ),
    "link7": (
        _rod("cylinder", 0.044, (0, 0, 0.052), (0, 0, 0.099)),
        _rod("cylinder", 0.0315, (0, 0, 0.099), (0, 0, 0.107)),
        Shell("box", (0.0430, 0.029, 0.0110), (0.0304, 0.0304, 0.0870), (0, 0, math.pi / 4)),
        Shell("box", (0.0380, 0.027, 0.0080), (0.0230, 0.0230, 0.0740), (0, -0.42, math.pi / 4)),
    ),
    "hand": (
        Shell("box", (0.0200, 0.0960, 0.0330), (0, 0, 0.0330)),
        _rod("capsule", 0.0190, (0, -0.081, 0.030), (0, 0.081, 0.030)),
        Shell("box", (0.0190, 0.1000, 0.0190), (0, 0, 0.0460)),
        Shell("box", (0.0250, 0.0860, 0.0110), (0, 0.004, 0.0030)),
        _rod("cylinder", 0.0315, (0, 0, -0.0025), (0, 0, 0.0135)),
        _rod("capsule", 0.0060, (0, -0.097, -0.020), (0, -0.051, -0.020)),
        Shell("box", (0.0060, 0.0250, 0.0100), (0, -0.074, -0.0100)),
    ),
    "left_finger": _FINGER,
    "right_finger": _FINGER,
}
