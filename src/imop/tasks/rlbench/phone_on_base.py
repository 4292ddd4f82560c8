"""Put the phone on its base."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

from imop.tasks.rlbench.conditions import Condition, Detected, NothingGrasped
from imop.tasks.rlbench.task import RLBenchTask


class PhoneOnBase(RLBenchTask):
    """Take the receiver and lay it onto the cradle."""

    name = "rlbench/phone_on_base"
    words = (
        "put the phone on the base",
        "place the phone on the base",
        "put the phone on the hub",
        "grasp the phone and put it on the base",
        "place the phone back on the base",
        "hang up the phone",
    )
    step_limit = 50
    graspable = ("phone",)

    def conditions(self) -> Sequence[Condition]:
        return [
            Detected("phone", "success"),
            NothingGrasped(),
        ]
