"""The upper bound of pose transfer: the demonstrated pose carried over by the true pose of the object."""

from typing import Protocol

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.types import Action, Demonstration, FloatArray, Observation


class Poses(Protocol):
    """What knows where things are, such as a simulated world."""

    def pose(self, body: str) -> FloatArray:
        """T_world_body (4, 4) now."""
        ...


class OraclePolicy:
    """Reads the simulator; whatever it fails at, no transfer by one rigid object can do."""

    def __init__(self, world: Poses):
        self._world = world
        self._demonstration: Demonstration | None = None
        self._step = 0

    def watch(self, demonstration: Demonstration) -> None:
        """Remember a demonstration whose keyframes tell their object and its pose.

        Raises:
            InvalidInput: if one does not.
        """
        for number, keyframe in enumerate(demonstration.keyframes):
            if keyframe.object_name is None or keyframe.T_world_object is None:
                raise InvalidInput(
                    f"keyframes[{number}].T_world_object",
                    "missing",
                    "a demonstration recorded in simulation, not stripped",
                )
        self._demonstration = demonstration

    def reset(self) -> None:
        """Begin with the first step."""
        self._step = 0

    def act(self, observation: Observation) -> Action:
        """T_j = T_world_object(now) T_world_object(demonstrated)^-1 T_i."""
        if self._demonstration is None:
            raise InvalidInput("demonstration", "none was watched", "watch(demonstration) before act")
        keyframe = self._demonstration.keyframes[min(self._step, len(self._demonstration) - 1)]
        self._step += 1
        if keyframe.object_name is None or keyframe.T_world_object is None:
            raise InvalidInput("T_world_object", "missing", "a demonstration recorded in simulation")
        T_object_gripper = se3.invert(keyframe.T_world_object) @ keyframe.action.T_world_gripper
        return Action(
            self._world.pose(keyframe.object_name) @ T_object_gripper,
            keyframe.action.gripper_open,
            keyframe.action.allow_collisions,
        )
