"""Put the square ring onto the peg of a colour."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence
from types import MappingProxyType

import numpy as np

from imop.tasks.rlbench.colors import NAMES, others
from imop.tasks.rlbench.conditions import Condition, Detected
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask


class InsertOntoSquarePeg(RLBenchTask):
    """Take the ring and let it down around the peg."""

    name = "rlbench/insert_onto_square_peg"
    aims = NAMES
    variations = len(NAMES)
    words = (
        "put the ring on the {} spoke",
        "slide the ring onto the {} colored spoke",
        "place the ring onto the {} spoke",
    )
    graspable = ("square_ring",)
    # The peg differs between episodes, its place has one name.
    frames = MappingProxyType({"waypoint3": "success_centre", "waypoint4": "success_centre"})

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        color = NAMES[self.variation]
        order = [str(pillar) for pillar in rng.permutation(["pillar0", "pillar1", "pillar2"])]
        for pillar, painted in zip(order, [color, *others(rng, color, 2)], strict=True):
            scene.paint(pillar, painted)
        x, y, _ = scene.pose(order[0])[:3, 3]
        scene.move("success_centre", (x, y, scene.pose("success_centre")[2, 3]))
        self.boundary(scene, rng, "boundary0").sample("square_ring")

    def conditions(self) -> Sequence[Condition]:
        return [Detected("square_ring", f"success_detector{k}") for k in range(4)]
