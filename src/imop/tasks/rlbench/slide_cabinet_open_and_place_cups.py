"""Slide a cabinet open and put the cup in. Written from a description; the file was never seen."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

import numpy as np

from imop.tasks.rlbench.conditions import Condition, Detected, JointMoved, NothingGrasped
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask

SIDES = ("left", "right")
_LEFT = (
    ("waypoint0", "left_initial_waypoint"),
    ("waypoint1", "left_close_waypoint"),
    ("waypoint2", "left_far_waypoint"),
    ("waypoint6", "place_cup_left_waypoint"),
)


class SlideCabinetOpenAndPlaceCups(RLBenchTask):
    """Slide the variation's door and leave the cup behind it."""

    name = "rlbench/slide_cabinet_open_and_place_cups"
    sizes = (0.85, 1.0)
    words = (
        "put the cup in the {} cabinet",
        "slide the {} cabinet open and place the cup inside",
        "slide open the {} door and put the cup away",
        "grasp the {} handle, slide the door open and put the cup in",
        "place the cup in the {} half of the cabinet",
    )
    step_limit = 50
    aims = SIDES
    variations = len(SIDES)
    yaw = (-3.14 / 4, 3.14 / 4)
    graspable = ("cup",)

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        for waypoint, place in _LEFT if SIDES[self.variation] == "left" else ():
            scene.move_to(waypoint, place)

    def conditions(self) -> Sequence[Condition]:
        return [
            Detected("cup", "success"),
            NothingGrasped(),
            JointMoved(f"{SIDES[self.variation]}_joint", 0.06),
        ]
