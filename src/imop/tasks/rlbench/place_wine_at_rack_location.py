"""Lay the wine bottle into a place of the rack."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

import numpy as np

from imop.tasks.rlbench.conditions import Condition, Detected, NothingGrasped
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask, Step

PLACES = ("middle", "left", "right")
ENDS = (("waypoint3", "waypoint4"), ("waypoint5", "waypoint6"), ("waypoint7", "waypoint8"))


class PlaceWineAtRackLocation(RLBenchTask):
    """Take the bottle by its neck and slide it into the variation's slot."""

    name = "rlbench/place_wine_at_rack_location"
    sizes = (0.85, 1.0)
    aims = PLACES
    variations = len(PLACES)
    words = (
        "stack the wine bottle to the {} of the rack",
        "slide the bottle onto the {} part of the rack",
        "put the wine away in the {} part of the rack",
        "leave the wine on the {} section of the shelf",
        "grasp the bottle and lay it on the {} of the wine rack",
    )
    yaw = (-np.pi / 4, np.pi / 4)
    graspable = ("wine_bottle",)

    def steps(self, scene: Scene) -> Sequence[Step]:
        way = ("waypoint0", "waypoint1", "waypoint2", *ENDS[self.variation])
        return [Step(name, frame=None if k < 3 else "rack_bottom") for k, name in enumerate(way)]

    def conditions(self) -> Sequence[Condition]:
        return [
            Detected("wine_bottle", f"success_{PLACES[self.variation]}"),
            NothingGrasped(),
        ]
