"""Press buttons of given colours in a given order."""

# ruff: noqa: D102 (the methods are described in Task)
from collections.abc import Sequence
from typing import Any

import numpy as np

from imop.sim.parts.button import CAP, HOUSING, OUT_OF_ORDER, PRESSED, STROKE, spring_button, watch_order
from imop.sim.parts.shapes import add_to
from imop.sim.parts.solids import trinket
from imop.sim.world import World
from imop.tasks.colors import NAMED, random_color
from imop.tasks.grasps import backed_off, from_above
from imop.tasks.layout import Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint

COLORS = tuple(NAMED)
COUNTS = (2, 3)
_BUTTONS = 5
_STRIDE = 3
"""Coprime to the number of colours, so that every colour comes first, second and third."""


def sequence(variation: int) -> tuple[str, ...]:
    """Colours in the order in which their buttons must be pressed."""
    start, count = variation // len(COUNTS), COUNTS[variation % len(COUNTS)]
    return tuple(COLORS[(start + _STRIDE * k) % len(COLORS)] for k in range(count))


class PressButtons(TableTask):
    """Press with the closed gripper from above. Done when these buttons, no others, were pressed in order."""

    name = "tabletop/press_buttons"
    told_by_color = True
    variations = len(COLORS) * len(COUNTS)

    def instructions(self, variation: int) -> tuple[str, ...]:
        colors = sequence(variation)
        return (
            "press the " + ", then the ".join(f"{c} button" for c in colors),
            "push down the buttons in the order " + ", ".join(colors),
        )

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        colors = sequence(variation)
        self.count = len(colors)
        others = [str(c) for c in rng.permutation([c for c in COLORS if c not in colors])]
        self.radius, housing = rng.uniform(0.017, 0.026), random_color(rng, 0.0, 0.5)
        for i, color in enumerate((*colors, *others[: _BUTTONS - self.count])):
            add_to(spec, f"button{i}", spring_button(self.radius, NAMED[color], housing))
        add_to(spec, "decoy", trinket("can", self.radius, rng.uniform(0.03, 0.06), NAMED[colors[0]]))
        for i in range(self.count - 1):
            watch_order(spec, f"order{i}", f"button{i}", f"button{i + 1}")

    def items(self) -> Sequence[Item]:
        rooms = [0.06 if i < self.count else 0.04 for i in range(_BUTTONS)]
        buttons = [Item(f"button{i}/body", ((0, 0, room),)) for i, room in enumerate(rooms)]
        return [*buttons, Item("decoy/body", ((0, 0, self.radius),))]

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        press = from_above((0, 0, -0.85 * STROKE))
        steps = []
        for i in range(self.count):
            cap = f"button{i}/cap"
            steps += [
                Waypoint(cap, backed_off(press, 0.08), gripper_open=False),
                Waypoint(cap, press, gripper_open=False, allow_collisions=True, linear=True),
            ]
            if i + 1 < self.count:
                # The cap is down when this is read, so the way up starts from the housing.
                up = from_above((0, 0, HOUSING + CAP + 0.07))
                steps.append(Waypoint(f"button{i}/body", up, False, allow_collisions=True, linear=True))
        return steps

    def success(self, world: World) -> bool:
        pressed = [world.joint(f"button{i}/pressed") > PRESSED for i in range(_BUTTONS)]
        wrong = any(world.joint(f"order{i}") > OUT_OF_ORDER for i in range(self.count - 1))
        return all(pressed[: self.count]) and not any(pressed[self.count :]) and not wrong
