"""A bottle with a screw cap: the jar's thread on a slender neck."""

from dataclasses import dataclass
from typing import Any

from imop.sim.parts import lathe
from imop.sim.parts.jar import NECK_LENGTH, NECK_WALL, JarShape, screw_lid, thread
from imop.sim.parts.shapes import PLASTIC, Color, cylinder, part


@dataclass(frozen=True)
class BottleShape:
    """Sizes of a bottle, metres.

    Attributes:
        neck: radius of the neck without its thread.
        radius: of the body.
        height: of the mouth above the table.
        shoulder: from the neck's foot down to where the body has its full radius.
    """

    neck: float
    radius: float
    height: float
    shoulder: float


def bottle(shape: BottleShape, color: Color, label_color: Color) -> Any:
    """An open bottle fixed on the table; frame: centre of the mouth. A cap goes on as a lid on a jar."""
    spec, body = part(fixed=True)
    base, foot, full = -shape.height, -NECK_LENGTH, -NECK_LENGTH - shape.shoulder
    trunk = [(0.92 * shape.radius, base), (shape.radius, base + 0.006), (shape.radius, full)]
    lathe.solid(spec, body, "trunk", trunk, color, PLASTIC)
    lathe.solid(spec, body, "shoulder", [(shape.radius, full), (shape.neck, foot)], color, PLASTIC)
    lathe.shell(spec, body, "neck", [(shape.neck, foot), (shape.neck, 0.0)], NECK_WALL, color, PLASTIC, 20)
    low, high = base + 0.2 * (full - base), base + 0.8 * (full - base)
    cylinder(body, shape.radius + 0.0006, low, high, label_color, PLASTIC)
    thread(spec, body, shape.neck, color)
    return spec


def cap(shape: BottleShape, color: Color, mark_color: Color) -> Any:
    """The cap for a bottle of `shape`; it moves freely. Frame: centre of its upper face, mark along x."""
    return screw_lid(JarShape(shape.neck, shape.radius, shape.height), color, mark_color)
