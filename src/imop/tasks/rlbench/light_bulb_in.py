"""Screw the bulb from the holder of a colour into the lamp."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence
from typing import Any

import numpy as np

from imop.sim.world import ROBOT
from imop.tasks.rlbench.colors import NAMES, others
from imop.tasks.rlbench.conditions import Condition, Detected, NothingGrasped
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask


class LightBulbIn(RLBenchTask):
    """Take the bulb out of its holder, put it into the socket, turn and let go."""

    name = "rlbench/light_bulb_in"
    sizes = (0.85, 1.0)
    told_by_color = True
    aims = NAMES
    variations = len(NAMES)
    words = (
        "screw in the {} light bulb",
        "screw the light bulb from the {} holder into the lamp",
        "pick up the light bulb from the {} stand and put it in the lamp",
        "put the light bulb from the {} casing into the lamp",
    )
    graspable = ("bulb_phys0", "bulb_phys1")

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        super().build(spec, variation, rng)
        for bulb in self.graspable:  # two millimetres of room in RLBench, none in our hand
            spec.add_exclude(bodyname1=f"{ROBOT}hand", bodyname2=bulb)

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        color, target = NAMES[self.variation], self.variation % 2
        room = self.boundary(scene, rng, "spawn_boundary")
        for holder in ("bulb_holder0", "bulb_holder1"):
            room.sample(holder)
        scene.paint(f"bulb_holder{target}", color)
        scene.paint(f"bulb_holder{1 - target}", others(rng, color)[0])
        scene.move("waypoint1", scene.point(f"bulb{target}", (0, 0, 0.01)))
        bulb = f"bulb_phys{target}"
        self.frames = {"waypoint0": bulb, "waypoint1": bulb, "waypoint2": "lamp_base"}

    def conditions(self) -> Sequence[Condition]:
        return [
            Detected(f"bulb_phys{self.variation % 2}", "success"),
            NothingGrasped(),
        ]
