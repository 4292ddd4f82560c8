"""Put one of nine groceries into the cupboard. Written from a description; the file was never seen."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

import numpy as np

from imop.tasks.rlbench.conditions import Condition, Detected, NothingGrasped
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.spawn import WORKSPACE, Boundary
from imop.tasks.rlbench.task import RLBenchTask

ITEMS = (
    "crackers",
    "chocolate_jello",
    "strawberry_jello",
    "soup",
    "tuna",
    "spam",
    "coffee",
    "mustard",
    "sugar",
)


class PutGroceriesInCupboard(RLBenchTask):
    """Take the variation's thing from among the others and leave it in the cupboard."""

    name = "rlbench/put_groceries_in_cupboard"
    sizes = (0.85, 1.0)
    words = (
        "put the {} in the cupboard",
        "pick up the {} and place it in the cupboard",
        "move the {} to the shelf",
        "put away the {} in the cupboard",
    )
    aims = tuple(item.replace("_", " ") for item in ITEMS)
    variations = len(ITEMS)
    root = "boundary_root"
    yaw = (-1.0, 1.0)
    graspable = ITEMS

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        room = Boundary(scene, rng, [WORKSPACE])
        for item in ITEMS:
            room.sample(item, min_distance=0.1)
        item = ITEMS[self.variation]
        scene.place_at("waypoint1", f"{item}_grasp_point")
        self.frames = dict.fromkeys(("waypoint0", "waypoint1", "waypoint2"), item)

    def conditions(self) -> Sequence[Condition]:
        return [
            Detected(ITEMS[self.variation], "success"),
            NothingGrasped(),
        ]
