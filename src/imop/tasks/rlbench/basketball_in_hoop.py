"""Drop the ball through the hoop."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

import numpy as np

from imop.tasks.rlbench.conditions import Condition, Detected
from imop.tasks.rlbench.task import RLBenchTask


class BasketballInHoop(RLBenchTask):
    """Take the ball and let it go over the hoop."""

    name = "rlbench/basketball_in_hoop"
    sizes = (0.75, 1.15)
    words = (
        "put the ball in the hoop",
        "play basketball",
        "shoot the ball through the net",
        "pick up the basketball and put it in the hoop",
        "throw the basketball through the hoop",
        "place the basket ball through the hoop",
    )
    step_limit = 50
    root = "basket_boundary_root"
    yaw = (-np.pi / 4, np.pi / 4)
    graspable = ("ball",)

    def conditions(self) -> Sequence[Condition]:
        return [
            Detected("ball", "success"),
        ]
