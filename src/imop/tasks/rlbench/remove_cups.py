"""Take cups off the holder."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence
from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.world import add_weld
from imop.tasks.rlbench.conditions import Condition, Detected, NothingGrasped
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask, Step, carried

MUGS = tuple(f"mug{k}" for k in range(4))
HOOK = "hook:"


class RemoveCups(RLBenchTask):
    """Pull one or two cups off their spokes and put them down on the table."""

    name = "rlbench/remove_cups"
    sizes = (0.85, 1.0)
    words = (
        "remove {} from the cup holder",
        "remove {} from the cup holder and place it on the table",
        "pick up {} from the holder and set it on the table",
        "take {} off the cup tree",
    )
    step_limit = 50
    aims = ("1 cup", "2 cups")
    variations = len(aims)
    yaw = (0.0, 0.0)
    graspable = ("mug0", "mug1", "mug2")

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        super().build(spec, variation, rng)
        # In the file the handles are millimetres inside the spokes, from where contacts would throw them.
        for k, mug in enumerate(MUGS):
            spec.add_exclude(bodyname1=mug, bodyname2=f"place_cups_holder_spoke{k}")
            add_weld(spec, f"{HOOK}{mug}", "place_cups_holder_base", mug)

    def on_step(self, scene: Scene) -> None:
        for mug in scene.world.held:
            scene.let_go(f"{HOOK}{mug}")

    def steps(self, scene: Scene) -> Sequence[Step]:
        steps: list[Step] = []
        for k in range(self.variation + 1):
            mug, spoke, place = f"mug{k}", f"place_cups_holder_spoke{k}", f"success_detector{k}"
            grasp = scene.pose(mug) @ scene.pose("waypoint1", frame="mug0")
            off = scene.pose(spoke) @ scene.pose("waypoint2", frame="place_cups_holder_spoke0")
            T_down = scene.pose("waypoint5")
            down = se3.make(T_down[:3, :3], (*scene.pose(place)[:2, 3], T_down[2, 3]))
            steps += carried(scene, mug, "waypoint1", grasp, ("waypoint0", "waypoint1"))
            steps += carried(scene, "place_cups_holder_base", "waypoint2", off, ("waypoint2", "waypoint3"))
            steps += carried(scene, "place_cups_holder_base", "waypoint5", down, ("waypoint4", "waypoint5"))
        return steps

    def conditions(self) -> Sequence[Condition]:
        down = [Detected(f"mug{k}", f"success_detector{k}") for k in range(self.variation + 1)]
        return [NothingGrasped(), *down]
