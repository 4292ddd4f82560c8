"""Hang cups onto the holder."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

import numpy as np

from imop.tasks.rlbench.conditions import Condition, DetectedSeveral, NothingGrasped
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask, Step, carried

MUGS = ("mug0", "mug1", "mug2")
SENSORS = tuple(f"success_detector{k}" for k in range(3))


class PlaceCups(RLBenchTask):
    """Take one to three cups from the table and push their handles onto the spokes."""

    name = "rlbench/place_cups"
    sizes = (0.85, 1.0)
    aims = ("1 cup", "2 cups", "3 cups")
    variations = len(aims)
    words = (
        "place {} on the cup holder",
        "pick up {} and place them on the holder",
        "move {} from the table to the cup holder",
        "hang {} on the spokes of the cup holder",
    )
    yaw = (-np.pi / 2, np.pi / 2)
    graspable = MUGS

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        room = self.boundary(scene, rng, "mug_boundary")
        for mug in MUGS:
            room.sample(mug, min_distance=0.1)

    def steps(self, scene: Scene) -> Sequence[Step]:
        steps: list[Step] = []
        for k in range(self.variation + 1):
            mug, spoke = f"mug{k}", f"place_cups_holder_spoke{k}"
            grasp = scene.pose(mug) @ scene.pose("waypoint1", frame="mug0")
            on = scene.pose(spoke) @ scene.pose("waypoint5", frame="place_cups_holder_spoke0")
            steps += carried(scene, mug, "waypoint1", grasp, ("waypoint0", "waypoint1", "waypoint2"))
            way = ("waypoint3", "waypoint4", "waypoint5", "waypoint6")
            steps += carried(scene, "place_cups_holder_base", "waypoint5", on, way)
        return steps

    def conditions(self) -> Sequence[Condition]:
        return [
            NothingGrasped(),
            DetectedSeveral(MUGS, SENSORS, self.variation + 1),
        ]
