"""Put the money on a shelf of the safe."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

import numpy as np

from imop.tasks.rlbench.conditions import Condition, Detected, NothingGrasped
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask

SHELVES = ("bottom", "middle", "top")


class PutMoneyInSafe(RLBenchTask):
    """Take the stack from the roof of the safe and lay it down inside."""

    name = "rlbench/put_money_in_safe"
    sizes = (0.85, 1.0)
    aims = SHELVES
    variations = len(SHELVES)
    words = (
        "put the money away in the safe on the {} shelf",
        "leave the money on the {} shelf on the safe",
        "place the stack of bank notes on the {} shelf of the safe",
    )
    yaw = (0.0, np.pi / 2)
    graspable = ("dollar_stack",)

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        scene.move_to("waypoint4", f"dummy_shelf{self.variation}")
        self.boundary(scene, rng, "dollar_stack_boundary").sample("dollar_stack", yaw=(0.0, np.pi / 2))

    def conditions(self) -> Sequence[Condition]:
        return [
            NothingGrasped(),
            Detected("dollar_stack", f"success_detector{self.variation}"),
        ]
