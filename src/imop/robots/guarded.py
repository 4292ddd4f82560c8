"""What every arm is kept to, whatever its driver does: the workspace, the speed limits, and Ctrl-C.

Motions run in a thread of their own, so that the caller can watch them and be interrupted.
"""

import threading
from collections.abc import Callable

import numpy as np

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.robots.interfaces import MotionFailure, MotionResult, Robot, RobotState
from imop.robots.limits import Limits
from imop.types import FloatArray, as_finite, as_fraction, as_pose

PERIOD = 0.02
"""Seconds between two looks at a moving arm."""
MARGIN = 0.02
"""A moving gripper may leave the workspace by so much, metres: lines of arms are not quite straight."""
WINDOW = 0.05
"""Speeds are means over at least so many seconds, for measured poses are noisy."""
TOLERANCE = 1.25
"""What is measured may be so many times as fast as is allowed."""


class GuardedRobot:
    """An arm that is not sent out of its workspace, and is stopped where it leaves it or is too fast.

    It is a `Robot` itself. Exceptions of the driver other than `InvalidInput` end as "disconnected", and an
    interrupt (Ctrl-C) while something moves stops the arm before it goes on to the caller.

    Args:
        robot: the driver.
        T_world_base: (4, 4) where the arm's base stands.
        lower, upper: (3,) corners of the workspace, metres, world frame.
        limits: how fast it may be.

    Raises:
        InvalidInput: for a value that is none of these.
    """

    def __init__(
        self, robot: Robot, T_world_base: FloatArray, lower: FloatArray, upper: FloatArray, limits: Limits
    ) -> None:
        self._robot, self._limits = robot, limits
        self._T_world_base = as_pose("T_world_base", T_world_base)
        self._lower, self._upper = as_finite("lower", lower, (3,)), as_finite("upper", upper, (3,))

    def state(self) -> RobotState:
        """As `Robot.state`."""
        return self._robot.state()

    def move_to(
        self, T_base_gripper: FloatArray, *, straight: bool = False, allow_collisions: bool = False
    ) -> MotionResult:
        """As `Robot.move_to`; nothing moves if the pose is outside of the workspace."""
        T = as_pose("T_base_gripper", T_base_gripper)
        if self._outside(T) > 0:
            p_world = (self._T_world_base @ T)[:3, 3]
            problem = f"{np.round(p_world, 3).tolist()} m, world frame"
            return MotionResult(False, "outside_workspace", problem)
        return self._watched(
            lambda: self._robot.move_to(T, straight=straight, allow_collisions=allow_collisions)
        )

    def move_gripper(self, opening: float) -> MotionResult:
        """As `Robot.move_gripper`."""
        wanted = as_fraction("opening", opening)
        return self._watched(lambda: self._robot.move_gripper(wanted))

    def stop(self) -> None:
        """As `Robot.stop`."""
        self._robot.stop()

    def recover(self) -> MotionResult:
        """As `Robot.recover`; an arm that does not answer may have to be recovered, so it is not watched."""
        try:
            return self._robot.recover()
        except Exception as error:
            return _disconnected(error)

    def _watched(self, motion: Callable[[], MotionResult]) -> MotionResult:
        """The motion's result, or why it was stopped."""
        ended: list[MotionResult | InvalidInput] = []

        def run() -> None:
            try:
                ended.append(motion())
            except InvalidInput as error:
                ended.append(error)
            except Exception as error:
                ended.append(_disconnected(error))

        moving = threading.Thread(target=run, daemon=True)
        try:
            before = self.state()
            moving.start()
            wrong = self._wrong(moving, before)
        except (ConnectionError, InvalidInput) as error:
            wrong = _disconnected(error)
        except BaseException:
            self._halt(moving)
            raise
        if wrong is not None:
            self._halt(moving)
            return wrong
        if isinstance(ended[0], InvalidInput):
            raise ended[0]
        return ended[0]

    def _wrong(self, moving: threading.Thread, before: RobotState) -> MotionResult | None:
        """Wait for the end of a motion; why it has to be stopped, if so."""
        # Somebody may have guided an arm out of the workspace by hand: back in it may go.
        allowed = MARGIN + self._outside(before.T_base_gripper)
        last = before
        while True:
            moving.join(PERIOD)
            if not moving.is_alive():
                return None
            now = self.state()
            if self._outside(now.T_base_gripper) > allowed:
                return _failed("outside_workspace", "the gripper left the workspace on its way")
            if now.stamp - last.stamp >= WINDOW:
                if fast := self._too_fast(last, now):
                    return _failed("speed_limit", fast)
                last = now

    def _outside(self, T_base_gripper: FloatArray) -> float:
        """How far the gripper is outside of the workspace, metres; 0 inside."""
        p = (self._T_world_base @ T_base_gripper)[:3, 3]
        return float(np.maximum(np.maximum(self._lower - p, p - self._upper), 0.0).max())

    def _too_fast(self, last: RobotState, now: RobotState) -> str:
        """What is too fast; empty if nothing is."""
        seconds = now.stamp - last.stamp
        T_last, T_now = last.T_base_gripper, now.T_base_gripper
        joints = float(np.abs(now.joint_positions - last.joint_positions).max(initial=0.0))
        measured = (
            ("the gripper", float(se3.translation_distance(T_last, T_now)), self._limits.speed, "m/s"),
            ("the gripper", float(se3.rotation_distance(T_last, T_now)), self._limits.turn, "rad/s"),
            ("a joint", joints, self._limits.joint_speed, "rad/s"),
        )
        for what, way, limit, unit in measured:
            if way / seconds > TOLERANCE * limit:
                return f"{what} moved at {way / seconds:.2f} {unit}, allowed are {limit:g}"
        return ""

    def _halt(self, moving: threading.Thread) -> None:
        """Stop until the motion has ended; what began only just may not have heard the first call."""
        while moving.is_alive():
            self._robot.stop()
            moving.join(PERIOD)


def _failed(reason: MotionFailure, detail: str) -> MotionResult:
    return MotionResult(False, reason, detail)


def _disconnected(error: Exception) -> MotionResult:
    return MotionResult(False, "disconnected", f"{type(error).__name__}: {error}")
