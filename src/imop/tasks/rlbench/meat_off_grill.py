"""Take one of two pieces of meat off the grill. Written from a description; the file was never seen."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

import numpy as np

from imop.tasks.rlbench.conditions import Condition, Detected, NothingGrasped
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask

MEATS = ("chicken", "steak")


class MeatOffGrill(RLBenchTask):
    """Grasp the variation's meat and put it down beside the grill."""

    name = "rlbench/meat_off_grill"
    sizes = (0.85, 1.0)
    words = (
        "take the {} off the grill",
        "pick up the {} and place it next to the grill",
        "remove the {} from the grill and set it down to the side",
    )
    aims = MEATS
    variations = len(MEATS)
    graspable = MEATS

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        meat = MEATS[self.variation]
        x, y, _ = scene.pose(meat)[:3, 3]
        scene.move("waypoint1", (x, y, scene.pose("waypoint1")[2, 3]))
        self.frames = dict.fromkeys(("waypoint0", "waypoint1", "waypoint2"), meat)

    def conditions(self) -> Sequence[Condition]:
        return [
            Detected(MEATS[self.variation], "success"),
            NothingGrasped(),
        ]
