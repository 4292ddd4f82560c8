"""Lift the lid off the saucepan."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

from imop.tasks.rlbench.conditions import Condition, Detected, Grasped
from imop.tasks.rlbench.task import RLBenchTask


class TakeLidOffSaucepan(RLBenchTask):
    """Take the lid by its knob and hold it over the pan."""

    name = "rlbench/take_lid_off_saucepan"
    words = (
        "take lid off the saucepan",
        "using the handle, lift the lid off of the pan",
        "remove the lid from the pan",
        "grip the saucepan's lid and remove it from the pan",
        "leave the pan open",
        "uncover the saucepan",
    )
    step_limit = 50
    graspable = ("saucepan_lid_grasp_point",)

    def conditions(self) -> Sequence[Condition]:
        return [
            Grasped("saucepan_lid_grasp_point"),
            Detected("saucepan_lid_grasp_point", "success"),
        ]
