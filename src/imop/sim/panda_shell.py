"""The outer shape of the Panda as primitives, frame by frame.

Lengths in metres, in the link frames of the modified Denavit-Hartenberg convention. The dimensions are
measured on the published shape of the arm; the finger boxes are those of franka_description.
"""

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


HALF_TURN = 3.141592653589793
ALONG_X = (0.0, HALF_TURN / 2, 0.0)
ALONG_Y = (HALF_TURN / 2, 0.0, 0.0)

# The fingers move along y; this is the one on the +y side of the hand, the other is turned by 180 degrees.
_FINGER = (
    Shell("box", (0.0105, 0.0075, 0.0095), (0, 0.0185, 0.0110)),
    Shell("box", (0.0105, 0.0044, 0.0019), (0, 0.0068, 0.0022)),
    Shell("box", (0.00875, 0.0035, 0.01175), (0, 0.0159, 0.02835), (HALF_TURN / 6, 0, 0)),
    Shell("box", (0.00875, 0.0062, 0.00875), (0, 0.0088, 0.04275), rgba=BLACK),
)

SHELLS: dict[str, tuple[Shell, ...]] = {
    "link0": (
        Shell("capsule", (0.060, 0.015, 0), (-0.075, 0, 0.060), ALONG_X),
        Shell("cylinder", (0.060, 0.070, 0), (0, 0, 0.070)),
    ),
    "link1": (Shell("capsule", (0.060, 0.0815, 0), (0, 0, -0.1115)),),
    "link2": (Shell("capsule", (0.055, 0.060, 0)),),
    "link3": (Shell("capsule", (0.055, 0.075, 0), (0, 0, -0.145)),),
    "link4": (Shell("capsule", (0.055, 0.060, 0)),),
    "link5": (
        Shell("capsule", (0.055, 0.050, 0), (0, 0, -0.260)),
        Shell("capsule", (0.025, 0.070, 0), (0, 0.080, -0.130)),
    ),
    "link6": (Shell("capsule", (0.050, 0.040, 0), (0, 0, -0.030)),),
    "link7": (Shell("capsule", (0.040, 0.0505, 0), (0, 0, 0.0155)),),
    "hand": (Shell("box", (0.032, 0.102, 0.033), (0, 0, 0.033)),),
    "left_finger": _FINGER,
    "right_finger": _FINGER,
}
