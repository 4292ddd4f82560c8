"""A rope: a chain of capsules linked by ball joints, with coloured ends."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from imop.sim.parts.shapes import Color, box, capsule, part
from imop.sim.world import World
from imop.types import FloatArray

_DENSITY, _END_DENSITY = 900.0, 2000.0
_FRICTION = (0.6, 0.02, 0.001)


@dataclass(frozen=True)
class RopeShape:
    """Metres: `links` capsules of `pitch` each, of `radius`."""

    links: int
    pitch: float
    radius: float

    @property
    def length(self) -> float:
        """Between the middles of the two end links of the straight rope."""
        return (self.links - 1) * self.pitch

    @property
    def ends(self) -> tuple[str, str]:
        """Names of the bodies at both ends."""
        return "body", "end"


def rope(shape: RopeShape, color: Color, end_colors: tuple[Color, Color]) -> Any:
    """A rope that moves freely, straight along +x; its links are "body", "link1", ... and "end".

    Frame of a link: its middle, +x to the next link.
    """
    spec, body = part()
    half = shape.pitch / 2
    for i in range(shape.links):
        if i > 0:
            # The end has one name whatever the number of links: what is done with it is the same.
            name = "end" if i == shape.links - 1 else f"link{i}"
            body = body.add_body(name=name, pos=[shape.pitch, 0, 0])
            body.add_joint(
                name=f"link{i}",
                type=mujoco.mjtJoint.mjJNT_BALL,
                pos=[-half, 0, 0],
                damping=0.0005,
                armature=2e-5,
            )
        if i in (0, shape.links - 1):
            # Flat end pieces keep the ends from rolling over when the rope is pulled.
            r, color_here = shape.radius, end_colors[i > 0]
            box(body, (-half, -1.6 * r, -r), (half, 1.6 * r, r), color_here, _END_DENSITY)
        else:
            capsule(body, (-half, 0, 0), (half, 0, 0), shape.radius, color, _DENSITY)
    for geom in spec.geoms:
        geom.friction = _FRICTION
    return spec


def bend(world: World, name: str, shape: RopeShape, angles: FloatArray) -> None:
    """Lay the rope `name` out in the plane: each link turned by `angles` (links - 1,) from the one before."""
    for i, angle in enumerate(angles, start=1):
        start = int(world.model.joint(f"{name}/link{i}").qposadr[0])
        world.data.qpos[start : start + 4] = (np.cos(angle / 2), 0, 0, np.sin(angle / 2))
    world.forward()


def outline(shape: RopeShape, angles: FloatArray) -> FloatArray:
    """Middles (links, 2) of the links as `bend` lays them out, in the first link's frame."""
    heading = np.concatenate([[0.0], np.cumsum(angles)])
    step = shape.pitch / 2 * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    return np.concatenate([np.zeros((1, 2)), np.cumsum(step[:-1] + step[1:], axis=0)])
