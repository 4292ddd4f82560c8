"""Close the door of the microwave."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence
from types import MappingProxyType

import numpy as np

from imop.tasks.rlbench.conditions import Condition, JointMoved
from imop.tasks.rlbench.task import RLBenchTask

_CLOSED = 0.69
"""RLBench says 40 degrees, which is where the door's stop is: only an overrun stop would do."""


class CloseMicrowave(RLBenchTask):
    """Push the open door shut."""

    name = "rlbench/close_microwave"
    words = (
        "close microwave",
        "shut the microwave",
        "close the microwave door",
        "push the microwave door shut",
    )
    step_limit = 50
    root = "boundary_root"
    yaw = (-np.pi / 8, np.pi / 8)
    frames = MappingProxyType(dict.fromkeys(("waypoint0", "waypoint1"), "microwave_frame_resp"))

    def conditions(self) -> Sequence[Condition]:
        return [
            JointMoved("microwave_door_joint", _CLOSED),
        ]
