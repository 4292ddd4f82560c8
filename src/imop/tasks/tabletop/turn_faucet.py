"""Turn a handle of a faucet."""

# ruff: noqa: D102 (the methods are described in Task)
from collections.abc import Sequence
from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.parts.faucet import SIDES, FaucetShape, direction, faucet
from imop.sim.parts.shapes import add_to
from imop.sim.world import World
from imop.tasks.colors import random_color
from imop.tasks.grasps import backed_off, from_above
from imop.tasks.layout import Area, Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint
from imop.types import FloatArray

_TURN = np.radians((30.0, 60.0, 90.0))
_OPEN = np.radians(75.0)
_OTHER = np.radians(15.0)
"""The other handle may be moved by less."""


class TurnFaucet(TableTask):
    """Grasp the variation's lever from above and turn it a quarter to the front; the other one stays."""

    name = "tabletop/turn_faucet"
    variations = len(SIDES)

    def instructions(self, variation: int) -> tuple[str, ...]:
        side = SIDES[variation]
        return (
            f"turn the {side} handle of the faucet",
            f"turn on the {side} tap",
            f"rotate the {side} lever to the front",
        )

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        self.side = SIDES[variation]
        self.graspable = (f"faucet/{self.side}",)
        self.shape = FaucetShape(
            spread=rng.uniform(0.088, 0.105),
            height=rng.uniform(0.08, 0.12),
            lever=rng.uniform(0.075, 0.095),
            radius=rng.uniform(0.006, 0.009),
            spout=rng.uniform(0.10, 0.14),
        )
        add_to(spec, "faucet", faucet(self.shape, random_color(rng, 0.4), random_color(rng)))

    def items(self) -> Sequence[Item]:
        y, reach = self.shape.spread, self.shape.lever + 0.03
        sides = tuple((0.02, sign * (y + 0.03), reach) for sign in (-1, 1))
        spout = (self.shape.spout - 0.03, 0.0, 0.06)
        return [Item("faucet/body", (*sides, spout), area=Area((0.05, 0.42), (-0.28, 0.28)))]

    def _grasp(self, angle: float) -> FloatArray:
        """T_body_gripper (4, 4) on the lever turned by `angle`."""
        sign = direction(self.side)
        axis = (0.0, sign * self.shape.spread, self.shape.height)
        lever = se3.make(se3.euler(z=sign * (np.pi / 2 - angle)), axis)
        return lever @ self._on_lever()

    def _on_lever(self) -> FloatArray:
        # The arm's wrist then is over the lever's end, not over the spout.
        return from_above((self.shape.lever - 0.02, 0, -0.006), np.pi)

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        handle, grasp = f"faucet/{self.side}", self._on_lever()
        T_handle_body = se3.invert(world.pose(handle)) @ world.pose("faucet/body")
        return [
            Waypoint(handle, backed_off(grasp, 0.08), gripper_open=True),
            Waypoint(handle, grasp, gripper_open=False, allow_collisions=True, linear=True),
            *(
                Waypoint(
                    handle, T_handle_body @ self._grasp(angle), False, allow_collisions=True, linear=True
                )
                for angle in _TURN
            ),
        ]

    def success(self, world: World) -> bool:
        angles = {side: world.joint(f"faucet/{side}") for side in SIDES}
        turned = angles.pop(self.side)
        return bool(turned > _OPEN and abs(*angles.values()) < _OTHER)
