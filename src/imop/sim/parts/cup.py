"""A cup with a handle, and a stand with a hook to hang it on."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from imop.sim.parts import lathe
from imop.sim.parts.shapes import METAL, PLASTIC, WOOD, Color, box, capsule, cylinder, part
from imop.types import FloatArray

WALL = 0.0035
_BAR = 0.004
"""Radius of the handle's bar."""
ROD, _KNOB = 0.005, 0.008
_ROD_TILT = np.radians(15.0)
_ROD_LENGTH = 0.095
HANG = 0.05
"""From the post to where a cup is hung, along the rod."""


@dataclass(frozen=True)
class CupShape:
    """Sizes of a cup, metres.

    Attributes:
        radius: outer, at the rim.
        height: of the cup.
        taper: radius at the base as a fraction of `radius`.
        reach: from the wall to the middle of the handle's outer bar.
    """

    radius: float
    height: float
    taper: float
    reach: float

    @property
    def loop(self) -> tuple[float, float, float, float]:
        """The opening of the handle in the cup's frame: x and z from and to."""
        x = self.radius + self.reach - _BAR
        return self.radius, x, -0.75 * self.height + _BAR, -0.16 * self.height - _BAR


def cup(shape: CupShape, color: Color) -> Any:
    """A cup that moves freely; frame: centre of the rim, handle towards +x."""
    spec, body = part()
    # Air and the hook's roughness, which the simulation lacks, end the swinging.
    spec.joint("free").damping = [2e-3, 0, 0]
    low, h = shape.taper * shape.radius, shape.height
    cylinder(body, low, -h, WALL - h, color, PLASTIC)
    wall = [(low, WALL - h), (shape.radius, 0.0)]
    lathe.shell(spec, body, "wall", wall, WALL, color, PLASTIC)
    _, x, bottom, top = shape.loop
    outer, top, bottom = x + _BAR, top + _BAR, bottom - _BAR
    inner_top = shape.radius + 0.001
    inner_bottom = low + (shape.radius - low) * (h + bottom) / h + 0.001
    for a, b in (
        ((inner_top, 0, top), (outer, 0, top)),
        ((outer, 0, top), (outer, 0, bottom)),
        ((outer, 0, bottom), (inner_bottom, 0, bottom)),
    ):
        capsule(body, a, b, _BAR, color, PLASTIC)
    return spec


def along_rod(distance: float) -> FloatArray:
    """A point (3,) of the rod's axis in the frame of "hook", `distance` outwards from where a cup hangs."""
    return distance * np.array([np.cos(_ROD_TILT), 0.0, np.sin(_ROD_TILT)])


def hook_stand(height: float, color: Color, base_color: Color) -> Any:
    """A post with a rod that rises towards +x, fixed on the table; frame: centre of its base.

    Body "hook" is where a cup hangs, on the rod's axis, turned as the stand.

    Args:
        height: where the rod leaves the post, metres.
        color: of post and rod.
        base_color: of the plate.
    """
    spec, body = part(fixed=True)
    box(body, (-0.06, -0.05, 0), (0.06, 0.05, 0.012), base_color, WOOD)
    cylinder(body, 0.010, 0.012, height + 0.012, color, WOOD)
    hook = body.add_body(name="hook", pos=np.array([0, 0, height]) + along_rod(HANG))
    tip = along_rod(_ROD_LENGTH - HANG)
    capsule(hook, along_rod(-HANG), tip, ROD, color, METAL)
    hook.add_geom(
        type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=tip, size=[_KNOB, 0, 0], rgba=[*color, 1], density=METAL
    )
    return spec
