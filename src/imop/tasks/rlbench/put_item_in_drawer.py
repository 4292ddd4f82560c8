"""Open one of three drawers and put the block into it."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence
from types import MappingProxyType

import numpy as np

from imop.tasks.rlbench.conditions import Condition, Detected
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask

LEVELS = ("bottom", "middle", "top")


class PutItemInDrawer(RLBenchTask):
    """Pull the variation's drawer, then fetch the block from the top of the cabinet."""

    name = "rlbench/put_item_in_drawer"
    sizes = (0.85, 1.0)
    aims = LEVELS
    variations = len(LEVELS)
    words = (
        "put the item in the {} drawer",
        "put the block away in the {} drawer",
        "open the {} drawer and place the item inside of it",
        "leave the block in the {} drawer",
    )
    yaw = (-np.pi / 8, np.pi / 8)
    graspable = ("item",)
    frames = MappingProxyType({f"waypoint{k}": "drawer_frame" for k in (0, 1, 2, 3, 4, 5, 9, 10)})

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        scene.move_to("waypoint2", f"waypoint_anchor_{LEVELS[self.variation]}")

    def conditions(self) -> Sequence[Condition]:
        return [
            Detected("item", f"success_{LEVELS[self.variation]}"),
        ]
