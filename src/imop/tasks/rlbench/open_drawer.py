"""Open one of three drawers."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

import numpy as np

from imop.tasks.rlbench.conditions import Condition, JointMoved
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask

LEVELS = ("bottom", "middle", "top")


class OpenDrawer(RLBenchTask):
    """Grip the variation's handle and pull."""

    name = "rlbench/open_drawer"
    sizes = (0.75, 1.0)
    aims = LEVELS
    variations = len(LEVELS)
    words = (
        "open the {} drawer",
        "grip the {} handle and pull the {} drawer open",
        "slide the {} drawer open",
    )
    yaw = (-np.pi / 8, np.pi / 8)

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        scene.move_to("waypoint1", f"waypoint_anchor_{LEVELS[self.variation]}")

    def conditions(self) -> Sequence[Condition]:
        return [
            JointMoved(f"drawer_joint_{LEVELS[self.variation]}", 0.15),
        ]
