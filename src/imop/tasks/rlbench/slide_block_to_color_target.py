"""Push the block onto the square of a colour."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

from imop.tasks.rlbench.conditions import Condition, Detected
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask, Step

TARGETS = ("green", "blue", "pink", "yellow")
ROUTES = ("ab", "abcde", "ab", "abcde")
"""Letters of the dummies that the gripper passes, for each target."""


class SlideBlockToColorTarget(RLBenchTask):
    """Push with the closed gripper, once or along two sides."""

    name = "rlbench/slide_block_to_color_target"
    told_by_color = True
    aims = TARGETS
    variations = len(TARGETS)
    words = (
        "slide the block to the {} target",
        "slide the block onto the {} square on the table top",
        "push the block until it is sitting on top of the {} target",
        "move the block towards the {} target",
        "cover the {} target with the block",
    )

    def steps(self, scene: Scene) -> Sequence[Step]:
        target = self.variation + 1
        points = [f"point{target}{letter}" for letter in ROUTES[self.variation]]
        frames = ["block", *(f"target{target}" for _ in points[1:])]
        return [Step(f"waypoint{k}", scene.pose(points[k]), frames[k]) for k in range(len(points))]

    def conditions(self) -> Sequence[Condition]:
        return [
            Detected("block", f"success{self.variation + 1}"),
        ]
