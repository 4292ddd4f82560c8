"""Throw the rubbish away."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

import numpy as np

from imop.tasks.rlbench.conditions import Condition, Detected
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask


class PutRubbishInBin(RLBenchTask):
    """Take the crumpled paper, not the tomatoes, and drop it into the bin."""

    name = "rlbench/put_rubbish_in_bin"
    sizes = (0.85, 1.0)
    words = (
        "put rubbish in bin",
        "drop the rubbish into the bin",
        "pick up the rubbish and leave it in the trash can",
        "throw away the trash, leaving any other objects alone",
        "chuck way any rubbish on the table rubbish",
    )
    step_limit = 50
    graspable = ("rubbish",)

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        other = ("tomato2", None, "tomato1")[int(rng.integers(3))]
        if other is not None:
            p, q = scene.pose("rubbish")[:3, 3], scene.pose(other)[:3, 3]
            scene.move("rubbish", (q[0], q[1], p[2]))
            scene.move(other, (p[0], p[1], q[2]))

    def conditions(self) -> Sequence[Condition]:
        return [
            Detected("rubbish", "success"),
        ]
