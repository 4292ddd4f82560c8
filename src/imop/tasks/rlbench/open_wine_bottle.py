"""Unscrew the wine bottle."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from imop.sim.world import CONTACT_SOLREF
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
        weld = spec.add_equality(name=_THREAD, type=mujoco.mjtEq.mjEQ_WELD)
        weld.objtype = mujoco.mjtObj.mjOBJ_BODY
        weld.name1, weld.name2 = "dummy", "cap"
        weld.solref = CONTACT_SOLREF

    def on_step(self, scene: Scene) -> None:
        if scene.moved("joint") > _LOOSE:
            world = scene.world
            world.data.eq_active[world.model.equality(_THREAD).id] = 0

    def conditions(self) -> Sequence[Condition]:
        return [
            Detected("cap", "cap_detector", negated=True),
        ]
