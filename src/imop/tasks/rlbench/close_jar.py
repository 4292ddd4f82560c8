"""Screw the lid onto the jar of a colour."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

import numpy as np

from imop.geometry import se3
from imop.tasks.rlbench.colors import NAMES, others
from imop.tasks.rlbench.conditions import Condition, Detected, NothingGrasped
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import DOWN, RLBenchTask


class CloseJar(RLBenchTask):
    """Take the lid, put it onto the jar and turn it a quarter."""

    name = "rlbench/close_jar"
    sizes = (0.85, 1.0)  # larger lids do not fit between the fingers
    told_by_color = True
    aims = NAMES
    variations = len(NAMES)
    words = (
        "close the {} jar",
        "screw on the {} jar lid",
        "grasp the lid, put it on the {} jar and screw it tight",
        "pick up the lid from the table and put it on the {} jar",
    )
    yaw = (-0.6 * np.pi, 0.6 * np.pi)
    graspable = ("jar_lid0",)

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        color, target = NAMES[self.variation], self.variation % 2
        room = self.boundary(scene, rng, "spawn_boundary")
        for jar in ("jar0", "jar1"):
            room.sample(jar)
        scene.paint(f"jar{target}", color)
        scene.paint(f"jar{1 - target}", others(rng, color)[0])
        scene.move("success", scene.point(f"jar{target}", (0, 0, 0.05)))
        scene.place("waypoint3", se3.make(DOWN, scene.point(f"jar{target}", (0, 0, 0.125))))
        lid = dict.fromkeys(("waypoint0", "waypoint1", "waypoint2"), "jar_lid0")
        self.frames = lid | dict.fromkeys(("waypoint3", "waypoint4", "waypoint5"), f"jar{target}")

    def conditions(self) -> Sequence[Condition]:
        return [
            NothingGrasped(),
            Detected("jar_lid0", "success"),
        ]
