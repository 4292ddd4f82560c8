"""Turn one of two taps. Written from a description; the file was never seen."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

import numpy as np

from imop.tasks.rlbench.conditions import Condition, JointMoved
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask, Step

SIDES = ("left", "right")


class TurnTap(RLBenchTask):
    """Grip the variation's handle and turn it."""

    name = "rlbench/turn_tap"
    sizes = (0.85, 1.0)
    words = (
        "turn the {} tap",
        "rotate the {} tap",
        "grasp the {} tap and turn it",
    )
    aims = SIDES
    variations = len(SIDES)

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        if SIDES[self.variation] == "right":
            scene.place_at("waypoint0", "waypoint5")
            scene.place_at("waypoint1", "waypoint6")

    def steps(self, scene: Scene) -> Sequence[Step]:
        return [Step("waypoint0"), Step("waypoint1")]

    def conditions(self) -> Sequence[Condition]:
        return [
            JointMoved(f"{SIDES[self.variation]}_joint", 1.57),
        ]
