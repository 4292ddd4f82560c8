"""A cabinet with drawers one above the other."""

from dataclasses import dataclass
from typing import Any

import mujoco

from imop.sim.parts.shapes import METAL, WOOD, Color, box, capsule, part

BOARD = 0.012
GAP = 0.003
PLINTH = 0.06
"""The lowest drawer's handle must be high enough for a hand on edge."""
HANDLE_OUT = 0.035
"""How far the handle's bar stands out from the front."""


@dataclass(frozen=True)
class CabinetShape:
    """Sizes in metres.

    Attributes:
        width: outer, along y.
        depth: outer, along x.
        drawer_height: of each front.
        handle_width: of each bar.
        drawers: how many.
    """

    width: float
    depth: float
    drawer_height: float
    handle_width: float
    drawers: int = 3

    @property
    def height(self) -> float:
        """Of the whole cabinet."""
        return PLINTH + self.drawers * (self.drawer_height + GAP) + GAP + 2 * BOARD

    @property
    def travel(self) -> float:
        """How far a drawer can be pulled."""
        return 0.8 * self.depth

    def handle_height(self, drawer: int) -> float:
        """Of the bar's centre above the cabinet's base."""
        return PLINTH + BOARD + GAP + drawer * (self.drawer_height + GAP) + self.drawer_height / 2


def drawer_cabinet(shape: CabinetShape, color: Color, front_color: Color, handle_color: Color) -> Any:
    """A fixed cabinet that opens towards +x; frame: centre of its base.

    Its drawers are the bodies "drawer0" (lowest), "drawer1", ... on slides of the same names, 0 closed;
    the frame of a drawer is the centre of its handle's bar, which lies along y.
    """
    spec, body = part(fixed=True)
    x, y, z = shape.depth / 2, shape.width / 2, shape.height
    box(body, (-x, -y, 0), (x - 0.02, y, PLINTH), color, WOOD)
    box(body, (-x, -y, PLINTH), (x, y, PLINTH + BOARD), color, WOOD)
    box(body, (-x, -y, z - BOARD), (x, y, z), color, WOOD)
    box(body, (-x, -y, PLINTH + BOARD), (BOARD - x, y, z - BOARD), color, WOOD)
    for side in (-1, 1):
        inner, outer = sorted((side * y, side * (y - BOARD)))
        box(body, (BOARD - x, inner, PLINTH + BOARD), (x, outer, z - BOARD), color, WOOD)
    for drawer in range(shape.drawers):
        _drawer(spec, body, shape, drawer, front_color, handle_color)
    return spec


def _drawer(spec: Any, body: Any, shape: CabinetShape, index: int, color: Color, handle_color: Color) -> None:
    name = f"drawer{index}"
    front = shape.depth / 2
    drawer = body.add_body(name=name, pos=[front + HANDLE_OUT, 0, shape.handle_height(index)])
    drawer.add_joint(
        name=name,
        type=mujoco.mjtJoint.mjJNT_SLIDE,
        axis=[1, 0, 0],
        range=[0, shape.travel],
        limited=mujoco.mjtLimited.mjLIMITED_TRUE,
        frictionloss=1.0,
        damping=4.0,
        armature=0.1,
    )
    spec.add_exclude(bodyname1="body", bodyname2=name)
    # Frame of the drawer: the bar's centre. Its front board closes flush with the cabinet.
    outer, inner = -HANDLE_OUT, -HANDLE_OUT - BOARD
    back = -HANDLE_OUT - shape.depth + BOARD + GAP
    y, z = shape.width / 2 - BOARD - GAP, shape.drawer_height / 2
    wall, low = 0.008, 0.01 - z
    box(drawer, (inner, -y, -z), (outer, y, z), color, WOOD)
    box(drawer, (back, -y, low - 0.006), (inner, y, low), color, WOOD)
    box(drawer, (back, -y, low), (back + wall, y, 0.5 * z), color, WOOD)
    box(drawer, (back + wall, -y, low), (inner, wall - y, 0.5 * z), color, WOOD)
    box(drawer, (back + wall, y - wall, low), (inner, y, 0.5 * z), color, WOOD)
    half = shape.handle_width / 2
    capsule(drawer, (0, -half, 0), (0, half, 0), 0.006, handle_color, METAL)
    for side in (-half, half):
        capsule(drawer, (outer, side, 0), (0, side, 0), 0.005, handle_color, METAL)
