"""Put a shape into the sorter through its hole."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

import numpy as np

from imop.tasks.coppelia.model import Model
from imop.tasks.rlbench.conditions import Condition, Detected
from imop.tasks.rlbench.edits import hollow
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask, Step, carried

SHAPES = ("cube", "cylinder", "triangular_prism", "star", "moon")


class PlaceShapeInShapeSorter(RLBenchTask):
    """Take the variation's shape and let it go over its hole."""

    name = "rlbench/place_shape_in_shape_sorter"
    aims = tuple(shape.replace("_", " ") for shape in SHAPES)
    variations = len(SHAPES)
    words = (
        "put the {} in the shape sorter",
        "pick up the {} and put it in the sorting box",
        "place the {} into its slot in the shape sorter",
        "slot the {} into the shape sorter",
    )
    graspable = SHAPES

    def load(self) -> Model:
        return hollow(super().load(), "shape_sorter_visual")

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        room = self.boundary(scene, rng, "boundary")
        for shape in SHAPES:
            room.sample(shape, min_distance=0.05)

    def steps(self, scene: Scene) -> Sequence[Step]:
        shape = SHAPES[self.variation]
        grasp, drop = scene.pose(f"{shape}_grasp_point"), scene.pose(f"{shape}_drop_point")
        return [
            *carried(scene, shape, "waypoint1", grasp, ("waypoint0", "waypoint1", "waypoint2")),
            *carried(scene, "shape_sorter", "waypoint4", drop, ("waypoint3", "waypoint4")),
        ]

    def conditions(self) -> Sequence[Condition]:
        return [
            Detected(SHAPES[self.variation], "success"),
        ]
