"""Pull the rope straight."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence
from types import MappingProxyType

from imop.tasks.rlbench.conditions import Condition, Detected
from imop.tasks.rlbench.task import RLBenchTask


class StraightenRope(RLBenchTask):
    """Drag each end of the rope onto its mark; it is held by friction alone."""

    name = "rlbench/straighten_rope"
    sizes = None
    words = (
        "straighten rope",
        "pull the rope straight",
        "grasping each end of the rope in turn, leave the rope straight on the table",
        "pull each end of the rope until is is straight",
        "tighten the rope",
        "pull the rope tight",
    )
    step_limit = 50
    table_friction = 1.0
    frames = MappingProxyType(
        {
            "waypoint0": "tail",
            "waypoint1": "head_tail",
            "waypoint2": "head_tail",
            "waypoint3": "head",
            "waypoint4": "head",
            "waypoint5": "head_target",
        }
    )

    def conditions(self) -> Sequence[Condition]:
        return [
            Detected("head", "success_head"),
            Detected("tail", "success_tail"),
        ]
