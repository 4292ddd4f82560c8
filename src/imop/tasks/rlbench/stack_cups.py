"""Stack two cups into the one of a colour."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

import numpy as np

from imop.tasks.rlbench.colors import NAMES, others
from imop.tasks.rlbench.conditions import Condition, Detected, NothingGrasped
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask


class StackCups(RLBenchTask):
    """Take the other cups by their rims and let them go over the first."""

    name = "rlbench/stack_cups"
    sizes = (0.75, 1.25)
    told_by_color = True
    aims = NAMES
    variations = len(NAMES)
    words = (
        "stack the other cups on top of the {} cup",
        "place two of the cups onto the odd cup out",
        "put the remaining two cups on top of the {} cup",
        "pick up and set the cups down into the {} cup",
        "create a stack of cups with the {} cup as its base",
        "keeping the {} cup on the table, stack the other two onto it",
    )
    graspable = ("cup1", "cup2", "cup3")

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        color = NAMES[self.variation]
        scene.paint("cup2_visual", color)
        room = self.boundary(scene, rng, "boundary")
        for cup in ("cup1", "cup3"):
            scene.paint(f"{cup}_visual", others(rng, color)[0])
        for cup in ("cup2", "cup1", "cup3"):
            room.sample(cup, yaw=(0.0, 0.0), min_distance=0.05)

    def conditions(self) -> Sequence[Condition]:
        return [
            Detected("cup1", "success"),
            Detected("cup3", "success"),
            NothingGrasped(),
        ]
