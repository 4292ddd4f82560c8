"""A faucet with two lever handles."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from imop.sim.parts.hinge import hinge
from imop.sim.parts.shapes import METAL, Color, box, capsule, part

SIDES = ("left", "right")
"""As seen by somebody in front of the faucet, who looks along -x."""
WIDEST = float(np.radians(110.0))
_PLATE = 0.012
_HOLD = 0.12


@dataclass(frozen=True)
class FaucetShape:
    """Sizes in metres.

    Attributes:
        spread: from the spout to the axis of each handle.
        height: of the levers above the base.
        lever: length of each lever from its axis.
        radius: of the levers.
        spout: how far the spout reaches to +x.
    """

    spread: float
    height: float
    lever: float
    radius: float
    spout: float


def direction(side: str) -> int:
    """Sign of y on which the handle of `side` is."""
    return 1 if side == "left" else -1


def faucet(shape: FaucetShape, color: Color, lever_color: Color) -> Any:
    """A fixed faucet whose spout points to +x; frame: centre of its base.

    The handles are the bodies "left" and "right" on upright hinges of the same names, 0 when the lever points
    away from the spout along y; growing angles turn it to the front. The frame of a handle is on its axis at
    the height of the lever, +x along the lever.
    """
    spec, body = part(fixed=True)
    y, z, r = shape.spread, shape.height, shape.radius
    box(body, (-0.03, -y - 0.03, 0), (0.03, y + 0.03, _PLATE), color, METAL)
    capsule(body, (0, 0, 0), (0, 0, 0.7 * z), 0.014, color, METAL)
    capsule(body, (0, 0, 0.7 * z), (0.6 * shape.spout, 0, z), 0.011, color, METAL)
    capsule(body, (0.6 * shape.spout, 0, z), (shape.spout, 0, 0.8 * z), 0.010, color, METAL)
    for side in SIDES:
        sign = direction(side)
        capsule(body, (0, sign * y, 0), (0, sign * y, z - 0.03), 0.013, color, METAL)
        half = np.pi / 4
        handle = body.add_body(
            name=side, pos=[0, sign * y, z], quat=[np.cos(half), 0, 0, sign * np.sin(half)]
        )
        hinge(handle, side, (0, 0, -sign), (0.0, WIDEST), friction=_HOLD, damping=0.02)
        capsule(handle, (0, 0, -0.018), (0, 0, 0), 0.015, lever_color, METAL)
        capsule(handle, (0, 0, 0), (shape.lever, 0, 0), r, lever_color, METAL)
        spec.add_exclude(bodyname1="body", bodyname2=side)
    return spec
