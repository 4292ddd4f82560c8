"""Set the clock."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence
from types import MappingProxyType

from imop.tasks.rlbench.conditions import Condition, Detected
from imop.tasks.rlbench.task import RLBenchTask


class ChangeClock(RLBenchTask):
    """Turn the knob at the back of the clock by a quarter."""

    name = "rlbench/change_clock"
    words = (
        "change the clock to show time 12.15",
        "adjust the time to 12.15",
        "change the clock to 12.15",
        "set the clock to 12.15",
        "turn the knob on the back of the clock until the time shows 12.15",
        "rotate the wheel on the clock to make it show 12.15",
        "make the clock say 12.15",
        "turn the knob of the clock 90 degrees",
    )
    step_limit = 50
    frames = MappingProxyType(dict.fromkeys(("waypoint0", "waypoint1", "waypoint2", "waypoint3"), "clock"))

    def conditions(self) -> Sequence[Condition]:
        return [
            Detected("clock_needle_minute", "detector_minute0"),
        ]
