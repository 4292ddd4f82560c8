"""Open the lid of the box."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence
from types import MappingProxyType

import numpy as np

from imop.tasks.rlbench.conditions import Condition, JointMoved
from imop.tasks.rlbench.task import RLBenchTask


class OpenBox(RLBenchTask):
    """Grip the edge of the lid and turn it up."""

    name = "rlbench/open_box"
    words = (
        "open box",
        "open the box lid",
        "grab the lid of the box and open it",
        "using the lid's edge, open the box",
    )
    step_limit = 50
    yaw = (-np.pi / 8, np.pi / 8)
    frames = MappingProxyType({"waypoint0": "box_base", "waypoint1": "box_base"})

    def conditions(self) -> Sequence[Condition]:
        return [
            JointMoved("box_joint", np.pi / 2),
        ]
