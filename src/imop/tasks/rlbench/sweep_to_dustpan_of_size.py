"""Sweep the dirt into one of two dustpans."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

from imop.tasks.rlbench.conditions import Condition, DetectedSeveral
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask, Step

PANS = ("tall", "short")
DIRT = tuple(f"dirt{k}" for k in range(5))


class SweepToDustpanOfSize(RLBenchTask):
    """Take the broom and sweep."""

    name = "rlbench/sweep_to_dustpan_of_size"
    sizes = (0.85, 1.0)
    aims = PANS
    variations = len(PANS)
    words = (
        "sweep dirt to the {} dustpan",
        "sweep the dirt up into the {} dustpan",
        "use the broom to brush the dirt into the {} dustpan",
        "clean up the dirt with the {} pan",
    )
    graspable = ("broom",)
    loose = DIRT

    def steps(self, scene: Scene) -> Sequence[Step]:
        route = [f"point{self.variation + 1}{letter}" for letter in "abc"]
        pan = f"dustpan_{PANS[self.variation]}"
        sweep = [Step(f"waypoint{k + 2}", scene.pose(point), pan) for k, point in enumerate(route)]
        return [Step("waypoint0"), Step("waypoint1"), *sweep]

    def conditions(self) -> Sequence[Condition]:
        return [
            DetectedSeveral(DIRT, (f"success_{PANS[self.variation]}",), len(DIRT)),
        ]
