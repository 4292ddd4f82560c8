"""A robot with its cameras, as a world to look at and act in."""

from collections.abc import Mapping

import numpy as np

from imop.cameras.interfaces import Camera
from imop.errors import PlanFailed
from imop.geometry import se3
from imop.robots.interfaces import Robot
from imop.setup.setup import Setup
from imop.types import Action, FloatArray, Observation
from imop.viewing.worlds import Outcome, straight

LAST_STEP = "the last step of the demonstration was done"


class RobotWorld:
    """What the drivers of an arm and its cameras say and do.

    Args:
        setup: says where all of it stands, and where the gripper may go.
        robot: driver of the arm, best a guarded one (`setup.drivers.connected`).
        cameras: drivers of all cameras of the set-up, by their names in it.
        steps: of the demonstration; when its last one was done the episode is over. By default somebody has
            to end it.
    """

    def __init__(
        self, setup: Setup, robot: Robot, cameras: Mapping[str, Camera], steps: int | None = None
    ) -> None:
        self._setup, self._robot, self._cameras, self._steps = setup, robot, cameras, steps
        self._performed = 0

    def observe(self) -> Observation:
        """A frame of every camera, then the state of the arm, which rests.

        Raises:
            ConnectionError: if one of them does not answer.
            InvalidInput: if they are not as the set-up says.
        """
        frames = {name: camera.capture() for name, camera in self._cameras.items()}
        return self._setup.observation(self._robot.state(), frames, self._performed)

    def way(self, action: Action) -> FloatArray:
        """Straight from where the arm is, for the driver alone knows better.

        Raises:
            PlanFailed: if the pose is not in the workspace.
            ConnectionError: if the arm does not answer.
        """
        p_goal, space = action.T_world_gripper[:3, 3], self._setup.workspace
        if np.any(p_goal < space.lower) or np.any(p_goal > space.upper):
            raise PlanFailed("outside_workspace", f"{np.round(p_goal, 3).tolist()} m")
        return straight(self._setup.T_world_gripper(self._robot.state()), action)

    def known(self) -> None:
        """Nobody has gone from here."""

    def perform(self, action: Action) -> Outcome:
        """Move, then open or close. What the arm does not do is said, and it can be told something else.

        Raises:
            PlanFailed, ConnectionError: as `way`; nothing has moved then.
        """
        self.way(action)
        T_base_gripper = se3.invert(self._setup.robot.T_world_base) @ action.T_world_gripper
        result = self._robot.move_to(T_base_gripper, allow_collisions=action.allow_collisions)
        if result.done:
            self._performed += 1
            result = self._robot.move_gripper(float(action.gripper_open))
        if result.done:
            step = self._performed - 1 if action.match is None else action.match.step
            over = self._steps is not None and step >= self._steps - 1
            return Outcome(over, LAST_STEP if over else "")
        recovered = self._robot.recover()
        again = "" if recovered.done else f"; it does not recover: {recovered.reason} {recovered.detail}"
        return Outcome(False, f"not done: {result.reason} {result.detail}{again}", result.reason)

    def stop(self) -> None:
        """Bring the arm to rest."""
        self._robot.stop()
