"""Put the square ring onto the peg of a colour."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

import numpy as np

from imop.tasks.rlbench.colors import NAMES, others
from imop.tasks.rlbench.conditions import Condition, Detected
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask

PILLARS = ("pillar0", "pillar1", "pillar2")


class InsertOntoSquarePeg(RLBenchTask):
    """Take the ring and let it down around the peg."""

    name = "rlbench/insert_onto_square_peg"
    sizes = (1.0, 1.15)
    told_by_color = True
    aims = NAMES
    variations = len(NAMES)
    words = (
        "put the ring on the {} spoke",
        "slide the ring onto the {} colored spoke",
        "place the ring onto the {} spoke",
    )
    graspable = ("square_ring",)

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        color = NAMES[self.variation]
        places = [scene.pose(pillar)[:3, 3] for pillar in PILLARS]
        # The aim always is the same peg, at another place.
        colors = [*others(rng, color, 2), color]
        for pillar, painted, k in zip(PILLARS, colors, rng.permutation(3), strict=True):
            scene.paint(pillar, painted)
            scene.move(pillar, places[k])
        self.boundary(scene, rng, "boundary0").sample("square_ring")

    def conditions(self) -> Sequence[Condition]:
        return [Detected("square_ring", f"success_detector{k}") for k in range(4)]
