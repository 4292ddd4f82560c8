"""Take the money off a shelf of the safe."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

import numpy as np

from imop.tasks.rlbench.conditions import Condition, Detected, NothingGrasped
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask

SHELVES = ("bottom", "middle", "top")
STACKS = ("dollar_stack0", "dollar_stack1", "dollar_stack2")
_YAW = (-np.pi / 10, 0.0)


class TakeMoneyOutSafe(RLBenchTask):
    """Take the variation's stack and lay it down on the table."""

    name = "rlbench/take_money_out_safe"
    sizes = (0.85, 1.0)
    words = (
        "take the money out of the {} shelf and place it on the table",
        "take the stack of money out of the {} shelf and place it on the table",
        "take one of the stacks of money out of the {} bit of the safe",
        "take the money off of the {} shelf of the safe",
        "grab the bank notes from the {} and leave it on the table",
        "get the money from the {} shelf",
        "retrieve the stack of bank notes from the {} of the safe",
        "locate the money on the {} shelf, grab it, and leave if on the table",
        "put the money on the {} shelf down on the table",
    )
    step_limit = 50
    aims = SHELVES
    variations = len(SHELVES)
    yaw = (-np.pi / 2, np.pi / 2)
    graspable = STACKS

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        stack = STACKS[self.variation]
        scene.place_at("waypoint1", f"dummy_shelf{self.variation}")
        self.boundary(scene, rng, "placement_boundary").sample("waypoint3", (-np.pi / 12, np.pi / 12), 0.0)
        T_stack_grasp = scene.pose("waypoint1", frame=stack)
        for moved in (stack, *STACKS):
            self.boundary(scene, rng, "money_boundary").sample(moved, _YAW, 0.0)
        scene.place("waypoint1", scene.pose(stack) @ T_stack_grasp)
        of_stack = dict.fromkeys(("waypoint0", "waypoint1", "waypoint2"), stack)
        self.frames = {**of_stack, "waypoint3": "safe_body"}

    def conditions(self) -> Sequence[Condition]:
        return [
            NothingGrasped(),
            Detected(STACKS[self.variation], "success_detector"),
        ]
