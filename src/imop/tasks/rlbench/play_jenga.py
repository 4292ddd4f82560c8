"""Take a block out of the tower."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence
from types import MappingProxyType

import numpy as np

from imop.tasks.rlbench.conditions import Condition, Detected, DetectedSeveral, NothingGrasped
from imop.tasks.rlbench.task import RLBenchTask

TOWER = tuple(f"Cuboid{i}" for i in range(13))


class PlayJenga(RLBenchTask):
    """Pull the protruding block out; nothing else may leave the tower."""

    name = "rlbench/play_jenga"
    words = (
        "play jenga",
        "pull out the green jenga block",
        "take the protruding block out of the jenga tower without the tower toppling",
    )
    step_limit = 50
    yaw = (-np.pi / 8, np.pi / 8)
    graspable = ("target_cuboid",)
    frames = MappingProxyType({f"waypoint{k}": "target_cuboid" for k in range(3)})

    def conditions(self) -> Sequence[Condition]:
        return [
            DetectedSeveral(TOWER, ("original_detector",), len(TOWER)),
            Detected("target_cuboid", "original_detector", negated=True),
            NothingGrasped(),
        ]
