"""Hang the clothes hanger on the rack."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

import numpy as np

from imop.tasks.rlbench.conditions import Condition, Detected, NothingGrasped
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.spawn import WORKSPACE, Boundary
from imop.tasks.rlbench.task import RLBenchTask


class PlaceHangerOnRack(RLBenchTask):
    """Take the hanger from its stand and hook it over the rail, which always stands beside the table."""

    name = "rlbench/place_hanger_on_rack"
    words = (
        "put the hanger on the rack",
        "pick up the hanger and place it on the clothes rack",
        "hang the clothes hanger on the rail",
    )
    step_limit = 50
    placed = False
    graspable = ("clothes_hanger",)

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        Boundary(scene, rng, [WORKSPACE]).sample("hanger_holder")

    def conditions(self) -> Sequence[Condition]:
        return [
            NothingGrasped(),
            Detected("clothes_hanger", "success_detector0"),
        ]
