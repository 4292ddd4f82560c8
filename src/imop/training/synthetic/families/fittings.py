"""Fittings that several families are made of: slanted boxes, flat-ended rods, boards, hinged links."""

from typing import Any

import mujoco
import numpy as np

from imop.geometry import se3
from imop.sim.parts.hinge import hinge
from imop.sim.parts.shapes import METAL, PLASTIC, WOOD, Color, Point, box, rgba
from imop.training.synthetic.families.thing import from_above
from imop.types import FloatArray

AHEAD = UPRIGHT = se3.euler(y=np.pi / 2)
"""Takes z to +x and x to -z: a tip points ahead; a board that lies becomes one that stands and faces +x."""
TIP = 0.0095
"""Height over the table at which flat things are taken: fingers reach 8 mm beyond the gripper's frame."""
_FOOT = 0.04


def slanted(
    body: Any, center: Point, half: Point, R: FloatArray, color: Color, density: float = PLASTIC
) -> None:
    """Add a box of half sizes `half` (3,) metres, turned by `R` (3, 3)."""
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=list(center),
        size=list(half),
        quat=se3.to_wxyz(R),
        rgba=rgba(color),
        density=density,
    )


def rod(body: Any, start: Point, end: Point, radius: float, color: Color, density: float = METAL) -> None:
    """Add a cylinder between two points."""
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        fromto=[*start, *end],
        size=[radius, 0, 0],
        rgba=rgba(color),
        density=density,
    )


def ball(body: Any, center: Point, radii: Point, color: Color, density: float = PLASTIC) -> None:
    """Add an ellipsoid of half axes `radii` (3,) metres."""
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_ELLIPSOID,
        pos=list(center),
        size=list(radii),
        rgba=rgba(color),
        density=density,
    )


def inner(body: Any, name: str, R: FloatArray, p: Point) -> Any:
    """A body that is fixed to `body`, turned by `R` (3, 3), at `p` metres."""
    return body.add_body(name=name, pos=list(p), quat=se3.to_wxyz(R))


def link(
    body: Any,
    name: str,
    p: Point,
    axis: tuple[float, float, float],
    limits: tuple[float, float],
    R: FloatArray | None = None,
) -> Any:
    """A body at `p` metres, turned by `R` (3, 3), on a hinge about `axis` of its own frame."""
    child = inner(body, name, np.eye(3) if R is None else R, p)
    hinge(child, name, axis, limits)
    return child


def board(body: Any, x: float, y: float, upright: bool, color: Color, thick: float = 0.012) -> Any:
    """A board of half sizes `x` and `y` metres that lies, or stands on a foot and faces +x.

    Returns:
        The body to fix things to: its frame is in the middle of the surface, z outwards; when the board
        stands, x points down.
    """
    if not upright:
        plate = inner(body, "board", np.eye(3), (0, 0, thick))
    else:
        plate = inner(body, "board", UPRIGHT, (thick / 2, 0, x))
        box(body, (-_FOOT, -0.7 * y, 0), (_FOOT, 0.7 * y, 0.01), color, WOOD)
    box(plate, (-x, -y, -thick), (x, y, 0), color, WOOD)
    return plate


def down_upright(p: tuple[float, float, float]) -> FloatArray:
    """T_board_gripper (4, 4) that comes straight down at `p` of a board that stands, closing along y."""
    return se3.make(UPRIGHT.T @ from_above((0, 0, 0))[:3, :3], p)
