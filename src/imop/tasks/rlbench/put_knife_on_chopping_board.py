"""Put the knife on the chopping board."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

import numpy as np

from imop.tasks.rlbench.conditions import Condition, Detected, InOrder, NothingGrasped
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask


class PutKnifeOnChoppingBoard(RLBenchTask):
    """Draw the knife from its block and lay it onto the board."""

    name = "rlbench/put_knife_on_chopping_board"
    words = (
        "put the knife on the chopping board",
        "slide the knife out of the knife block and put it down on the chopping board",
        "place the knife on the chopping board",
        "pick up the knife and leave its on the chopping board",
        "move the knife from the holder to the chopping board",
    )
    step_limit = 50
    graspable = ("knife",)

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        self.boundary(scene, rng, "boundary").sample("knife_block")

    def conditions(self) -> Sequence[Condition]:
        return [
            InOrder([Detected("knife", "success"), NothingGrasped()]),
        ]
