"""Turn the lamp on."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

import numpy as np

from imop.tasks.coppelia.model import Model
from imop.tasks.rlbench.conditions import Condition, JointMoved
from imop.tasks.rlbench.edits import fixed
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask

_PRESSED = 0.003


class LampOn(RLBenchTask):
    """Hold the button down with the closed gripper."""

    name = "rlbench/lamp_on"
    words = (
        "turn on the light",
        "press the button to turn on the lamp",
        "press the light switch",
        "turn the lamp on",
        "close the gripper and press on the button until the light turns on",
    )
    step_limit = 50

    def load(self) -> Model:
        return fixed(super().load(), "bulb_phys")

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        scene.paint("bulb", "black")

    def on_step(self, scene: Scene) -> None:
        if scene.moved("target_button_joint") > _PRESSED:
            scene.paint("bulb", "white")

    def conditions(self) -> Sequence[Condition]:
        return [
            JointMoved("target_button_joint", _PRESSED),
        ]
