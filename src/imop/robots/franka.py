"""A Franka arm (FR3, Panda) with its hand, through franky (package franky-control). Lines without obstacles.

The gripper goes along straight lines, for franky plans around nothing. Stamps are the host's clock.
"""

import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from imop.extras import extra
from imop.geometry import se3
from imop.robots.arrived import arrived
from imop.robots.interfaces import DONE, MotionFailure, MotionResult, RobotState
from imop.robots.limits import Limits
from imop.types import FloatArray, as_fraction, as_pose

with extra("franka"):
    import franky

POLL = 0.01
"""Seconds between two looks for a stop."""
GRIPPER_SPEED, GRASP_FORCE = 0.1, 20.0
"""Of the fingers, metres per second and newtons."""
DYNAMICS = 0.2
"""Share of the arm's own limits of acceleration and jerk."""


class FrankaRobot:
    """A Franka arm as a `Robot`. Its speed limits are the arm's own, or lower.

    Args:
        address: of the arm's controller.
        limits: how fast it may be.
        T_flange_gripper: (4, 4) of imop's gripper frame.
        realtime: whether a kernel without real-time priorities is refused, as franky does by default.

    Raises:
        MissingExtra: without franky.
        ConnectionError: if the arm or its hand does not answer.
    """

    def __init__(
        self, address: str, limits: Limits, T_flange_gripper: FloatArray, realtime: bool = True
    ) -> None:
        self._T_flange_gripper = as_pose("T_flange_gripper", T_flange_gripper)
        self._stop = threading.Event()
        config = franky.RealtimeConfig.Enforce if realtime else franky.RealtimeConfig.Ignore
        try:
            self._arm = franky.Robot(address, realtime_config=config)
            self._hand = franky.Gripper(address)
            self._T_flange_ee = np.asarray(self._arm.state.F_T_EE.matrix)
            self._keep_to(limits)
        except (franky.Exception, RuntimeError) as error:
            raise ConnectionError(f"{address}: {error}") from error

    def state(self) -> RobotState:
        """As `Robot.state`."""
        try:
            arm, hand = self._arm.state, self._hand.state
        except (franky.Exception, RuntimeError) as error:
            raise ConnectionError(f"the arm does not answer: {error}") from error
        T_base_gripper = np.asarray(arm.O_T_EE.matrix) @ self._T_ee_gripper
        opening = np.clip(hand.width / hand.max_width, 0.0, 1.0) if hand.max_width > 0 else 0.0
        return RobotState(se3.orthonormal(T_base_gripper), float(opening), np.asarray(arm.q), time.time())

    def move_to(
        self, T_base_gripper: FloatArray, *, straight: bool = False, allow_collisions: bool = False
    ) -> MotionResult:
        """As `Robot.move_to`, always along a line."""
        goal = as_pose("T_base_gripper", T_base_gripper)

        def go() -> MotionResult:
            if self._arm.has_errors:
                return MotionResult(False, "not_ready", "the arm has an error: recover it")
            target = franky.Affine(goal @ se3.invert(self._T_ee_gripper))
            self._arm.move(franky.CartesianMotion(target), asynchronous=True)
            halting = False
            while not self._arm.join_motion(timeout=POLL):
                if self._stop.is_set() and not halting:
                    # Takes over from the line and brakes within the arm's limits.
                    self._arm.move(franky.CartesianStopMotion(), asynchronous=True)
                    halting = True
            if halting:
                return MotionResult(False, "stopped", "stop was called")
            return arrived(self, goal)

        return self._done(go)

    def move_gripper(self, opening: float) -> MotionResult:
        """As `Robot.move_gripper`; closing wholly grasps whatever is there, with `GRASP_FORCE`."""
        wanted = as_fraction("opening", opening)

        def go() -> MotionResult:
            hand = self._hand.state
            width = wanted * hand.max_width
            if wanted == 0.0:
                anything = {"epsilon_inner": 1.0, "epsilon_outer": 1.0}
                moving = self._hand.grasp_async(width, GRIPPER_SPEED, GRASP_FORCE, **anything)
            else:
                moving = self._hand.move_async(width, GRIPPER_SPEED)
            while not moving.wait(POLL):
                if self._stop.is_set():
                    self._hand.stop()
                    return MotionResult(False, "stopped", "stop was called")
            if not moving.get() and width >= hand.width:
                return MotionResult(False, "not_arrived", "the fingers did not open")
            return DONE

        return self._done(go)

    def stop(self) -> None:
        """As `Robot.stop`."""
        self._stop.set()

    def recover(self) -> MotionResult:
        """Franka's automatic recovery; a pressed button has to be released first."""

        def go() -> MotionResult:
            if not self._arm.has_errors or self._arm.recover_from_errors():
                return DONE
            return MotionResult(False, "not_ready", f"{self._arm.state.robot_mode}")

        return self._done(go)

    def close(self) -> None:
        """Stop; the connection ends with the object."""
        self.stop()

    @property
    def _T_ee_gripper(self) -> FloatArray:
        """From Franka's own end effector, which may be anywhere, to imop's gripper."""
        return np.asarray(se3.invert(self._T_flange_ee) @ self._T_flange_gripper)

    def _keep_to(self, limits: Limits) -> None:
        arm = self._arm
        for limit, value in (
            (arm.translation_velocity_limit, limits.speed),
            (arm.rotation_velocity_limit, limits.turn),
            (arm.elbow_velocity_limit, limits.joint_speed),
        ):
            limit.set(min(value, limit.max))
        joints = arm.joint_velocity_limit
        joints.set(np.minimum(limits.joint_speed, joints.max))
        arm.relative_dynamics_factor = franky.RelativeDynamicsFactor(1.0, DYNAMICS, DYNAMICS)

    def _done(self, go: Callable[[], MotionResult]) -> MotionResult:
        self._stop.clear()
        try:
            return go()
        except ConnectionError as error:
            return MotionResult(False, "disconnected", f"{error}")
        except (franky.Exception, RuntimeError) as error:
            return MotionResult(False, _reason(error), f"{error}")


def _reason(error: Any) -> MotionFailure:
    """What libfranka's exception says of the arm."""
    if isinstance(error, franky.NetworkException):
        return "disconnected"
    if isinstance(error, franky.ControlException):
        return "protective_stop"
    return "not_ready"
