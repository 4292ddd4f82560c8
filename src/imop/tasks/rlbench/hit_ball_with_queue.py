"""Hit the ball into the goal."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence
from types import MappingProxyType

from imop.tasks.rlbench.conditions import Condition, Detected, Grasped, InOrder
from imop.tasks.rlbench.task import RLBenchTask


class HitBallWithQueue(RLBenchTask):
    """Take the queue and push the ball with its end; it rolls on by itself."""

    name = "rlbench/hit_ball_with_queue"
    words = (
        "hit ball with queue in to the goal",
        "hit the ball into the goal with the queue",
        "pot the ball in the goal",
    )
    step_limit = 50
    graspable = ("queue",)
    frames = MappingProxyType({"waypoint3": "ball", "waypoint4": "ball"})

    def conditions(self) -> Sequence[Condition]:
        return [
            InOrder([Grasped("queue"), Detected("ball", "success")]),
        ]
