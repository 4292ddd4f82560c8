"""Put the ring of a colour over the peg of that colour."""

# ruff: noqa: D102 (the methods are described in Task)
from collections.abc import Sequence
from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.parts.peg import PLATE, RingShape, peg, ring
from imop.sim.parts.shapes import add_to
from imop.sim.parts.solids import trinket
from imop.sim.world import World
from imop.tasks.colors import NAMED, random_color
from imop.tasks.grasps import backed_off, from_above, shifted
from imop.tasks.layout import Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint

COLORS = tuple(NAMED)
_HAND = 0.065
"""Around a grip, for the fingers."""
_DROP = 0.006
_TIP = 0.005
"""Of the finger ends above the ring's underside."""


class RingOnPeg(TableTask):
    """Take the ring by its grip; pegs of other colours and a ring of another colour distract.

    So does a can of the same colour.
    """

    name = "tabletop/ring_on_peg"
    told_by_color = True
    variations = len(COLORS)

    def instructions(self, variation: int) -> tuple[str, ...]:
        color = COLORS[variation]
        return (
            f"put the {color} ring on the {color} peg",
            f"slide the {color} ring over the {color} peg",
            f"pick up the {color} ring and drop it onto the peg of its colour",
        )

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        self.graspable = ("ring/body", "other_ring/body")
        hole = rng.uniform(0.018, 0.024)
        self.shape = RingShape(
            hole=hole,
            width=rng.uniform(0.010, 0.014),
            height=rng.uniform(0.012, 0.018),
            peg_radius=hole - rng.uniform(0.005, 0.007),
            peg_height=rng.uniform(0.07, 0.10),
        )
        wood, grip, color = random_color(rng, 0.3), random_color(rng, 0.0, 0.3), COLORS[variation]
        others = [str(c) for c in rng.permutation([c for c in COLORS if c != color])[:2]]
        add_to(spec, "ring", ring(self.shape, NAMED[color], grip))
        add_to(spec, "other_ring", ring(self.shape, NAMED[others[0]], grip))
        add_to(spec, "peg", peg(self.shape, NAMED[color], wood))
        for i, other in enumerate(others):
            add_to(spec, f"other_peg{i}", peg(self.shape, NAMED[other], wood))
        add_to(spec, "decoy", trinket("can", 0.02, rng.uniform(0.05, 0.08), NAMED[color]))

    def items(self) -> Sequence[Item]:
        r, grip = self.shape.outer, self.shape.grip
        plate, hand = (-0.01, 0.0, r + 0.018), (grip, 0.0, _HAND)
        held = ((0.0, 0.0, r + 0.004), hand)
        return [
            Item("peg/body", (plate, hand)),
            Item("ring/body", held),
            Item("other_ring/body", (held[0], (grip, 0.0, 0.03))),
            *(Item(f"other_peg{i}/body", (plate,)) for i in range(2)),
            Item("decoy/body", ((0, 0, 0.02),)),
        ]

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        grasp = from_above((self.shape.grip, 0, _TIP))
        around = shifted(grasp, (0, 0, PLATE + _DROP))
        over = shifted(grasp, (0, 0, self.shape.peg_height + 0.025))
        ring, peg = "ring/body", "peg/body"
        return [
            Waypoint(ring, backed_off(grasp, 0.10), gripper_open=True),
            Waypoint(ring, grasp, gripper_open=False, allow_collisions=True, linear=True),
            Waypoint(ring, shifted(grasp, (0, 0, 0.16)), False, allow_collisions=True, linear=True),
            Waypoint(peg, over, gripper_open=False),
            Waypoint(peg, around, gripper_open=True, allow_collisions=True, linear=True),
        ]

    def success(self, world: World) -> bool:
        T_peg_ring = se3.invert(world.pose("peg/body")) @ world.pose("ring/body")
        play = self.shape.hole - self.shape.peg_radius + 0.003
        around = np.hypot(T_peg_ring[0, 3], T_peg_ring[1, 3]) < play
        down = abs(T_peg_ring[2, 3] - PLATE) < 0.004 and T_peg_ring[2, 2] > 0.98
        return not world.held and bool(around and down)
