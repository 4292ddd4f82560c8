"""Open the door."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence
from types import MappingProxyType

import numpy as np

from imop.tasks.rlbench.conditions import Condition, JointMoved
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask

_TURNED = np.radians(25.0)
_LOCKED, _FREE = 100.0, 0.05
"""Friction of the hinge, N m."""


class OpenDoor(RLBenchTask):
    """Press the handle down and push; the door is locked as long as the handle was not pressed."""

    name = "rlbench/open_door"
    words = (
        "open the door",
        "grip the handle and push the door open",
        "use the handle to open the door",
    )
    step_limit = 50
    root = "boundary_root"
    yaw = (-np.pi / 4, np.pi / 4)
    frames = MappingProxyType({"waypoint2": "door_frame", "waypoint3": "door_frame"})

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        self._rub(scene, _LOCKED)

    def on_step(self, scene: Scene) -> None:
        if scene.moved("door_handle_joint") > _TURNED:
            self._rub(scene, _FREE)

    @staticmethod
    def _rub(scene: Scene, torque: float) -> None:
        m = scene.world.model
        m.dof_frictionloss[m.joint("door_frame_joint").dofadr[0]] = torque

    def conditions(self) -> Sequence[Condition]:
        return [
            JointMoved("door_frame_joint", _TURNED),
        ]
