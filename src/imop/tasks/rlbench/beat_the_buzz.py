"""Move the ring along the pole."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

from imop.tasks.rlbench.conditions import Condition, Detected, NothingGrasped
from imop.tasks.rlbench.task import RLBenchTask


class BeatTheBuzz(RLBenchTask):
    """Take the wand and pull its ring off the pole without touching the middle of it."""

    name = "rlbench/beat_the_buzz"
    words = (
        "beat the buzz",
        "slide the ring along the pole without touching it",
        "move the ring to the end of the pole",
        "take the ring from one end of the pole to the other",
        "pull the wand along the rod without touching the pole",
        "grasp the wand and drag it until the end of the pole",
        "keep the ring away from the pole and move it to the other end",
    )
    step_limit = 50
    graspable = ("wand",)

    def fails(self) -> Sequence[Condition]:
        return [Detected("wand", "middle_sensor")]

    def conditions(self) -> Sequence[Condition]:
        return [
            Detected("wand", "right_sensor"),
            NothingGrasped(),
        ]
