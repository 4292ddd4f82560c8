"""Close the laptop."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

from imop.tasks.coppelia.model import Model
from imop.tasks.rlbench.conditions import Condition, JointMoved
from imop.tasks.rlbench.edits import reworded
from imop.tasks.rlbench.task import RLBenchTask


class CloseLaptopLid(RLBenchTask):
    """Push the lid over and down."""

    name = "rlbench/close_laptop_lid"
    sizes = (0.75, 1.0)
    words = (
        "close laptop lid",
        "close the laptop",
        "shut the laptop lid",
    )
    step_limit = 50

    def load(self) -> Model:
        # Opened by a tenth as the file says, one of our fingers stays below the lid and holds it up.
        return reworded(super().load(), "waypoint2", "ignore_collisions")

    def conditions(self) -> Sequence[Condition]:
        return [
            JointMoved("joint", 1.79),
        ]
