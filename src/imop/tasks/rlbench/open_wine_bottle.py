"""Unscrew the wine bottle."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence
from typing import Any

import numpy as np

from imop.sim.world import add_weld
from imop.tasks.coppelia.model import Model
from imop.tasks.rlbench.conditions import Condition, Detected
from imop.tasks.rlbench.edits import loosened
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask

_LOOSE = np.radians(150.0)
_THREAD = "thread"


class OpenWineBottle(RLBenchTask):
    """Turn the cap half around and lift it off; it holds until it was turned."""

    name = "rlbench/open_wine_bottle"
    words = (
        "open wine bottle",
        "screw open the wine bottle",
        "unscrew the bottle cap then remove it from the wine bottle",
    )
    step_limit = 50

    def load(self) -> Model:
        return loosened(super().load(), "cap")

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        super().build(spec, variation, rng)
        add_weld(spec, _THREAD, "dummy", "cap")

    def on_step(self, scene: Scene) -> None:
        if scene.moved("joint") > _LOOSE:
            scene.let_go(_THREAD)

    def conditions(self) -> Sequence[Condition]:
        return [
            Detected("cap", "cap_detector", negated=True),
        ]
