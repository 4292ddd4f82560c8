"""Lift the cube with the spatula."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence
from types import MappingProxyType

from imop.tasks.rlbench.conditions import Condition, Detected, Grasped
from imop.tasks.rlbench.task import RLBenchTask


class ScoopWithSpatula(RLBenchTask):
    """Take the spatula, slide it under the cube and lift."""

    name = "rlbench/scoop_with_spatula"
    sizes = (0.75, 1.25)
    words = (
        "scoop up the cube and lift it with the spatula",
        "scoop up the block with the spatula",
        "use the spatula to scoop up the cube",
        "pick up the cube using the spatula",
        "grasp the handle of the spatula, slide it under the cube and lift",
        "lift the cube up with the spatula",
    )
    step_limit = 50
    graspable = ("scoop_with_spatula_spatula",)
    loose = ("Cuboid",)
    frames = MappingProxyType({"waypoint2": "Cuboid", "waypoint3": "Cuboid"})

    def conditions(self) -> Sequence[Condition]:
        return [
            Detected("Cuboid", "success"),
            Grasped("scoop_with_spatula_spatula"),
        ]
