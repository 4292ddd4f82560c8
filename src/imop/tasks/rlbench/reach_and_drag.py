"""Drag the cube onto the square of a colour with a stick."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence
from types import MappingProxyType

import numpy as np

from imop.tasks.rlbench.colors import NAMES
from imop.tasks.rlbench.conditions import Condition, Detected
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask


class ReachAndDrag(RLBenchTask):
    """Take the stick, put its end behind the cube and drag."""

    name = "rlbench/reach_and_drag"
    sizes = (0.8, 1.0)
    told_by_color = True
    aims = NAMES
    variations = len(NAMES)
    words = (
        "use the stick to drag the cube onto the {} target",
        "pick up the stick and use it to push or pull the cube onto the {} target",
        "drag the block towards the {} square on the table top",
        "grasp the stick by one end and pull the cube onto the {} target",
    )
    graspable = ("stick",)
    frames = MappingProxyType({"waypoint3": "cube", "waypoint4": "cube", "waypoint5": "target0"})

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        scene.paint("target0", NAMES[self.variation])
        for k in (1, 2, 3):
            scene.paint(f"distractor{k}", NAMES[(self.variation + 4 + k) % len(NAMES)])

    def conditions(self) -> Sequence[Condition]:
        return [
            Detected("cube", "success0"),
        ]
