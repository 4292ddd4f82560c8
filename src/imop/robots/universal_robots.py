"""An arm of Universal Robots (e-Series, CB3 from 3.3 on) through ur_rtde. Lines without obstacles.

Stamps are the host's clock. The arm has to be in remote control.
"""

import threading
import time
from collections.abc import Callable
from typing import Protocol

import numpy as np

from imop.extras import extra
from imop.geometry import se3
from imop.robots.arrived import ARRIVED, SETTLING
from imop.robots.interfaces import DONE, MotionResult, RobotState
from imop.robots.limits import Limits
from imop.robots.universal_robots_poses import from_vector, to_vector
from imop.types import FloatArray, as_fraction, as_pose

with extra("universal_robots"):
    from dashboard_client import DashboardClient
    from rtde_control import RTDEControlInterface
    from rtde_receive import RTDEReceiveInterface

POLL = 0.01
"""Seconds between two looks at the moving arm."""
ACCELERATION, BRAKING = 0.5, 2.0
"""Of the gripper, metres per second squared; in a motion, and when it is stopped."""
SLOWEST = 0.01
"""Metres per second, of a motion that turns more than it moves."""
AT_REST = 0.001
"""The gripper rests below this speed, metres (or radians) per second."""
UNLOCK_AFTER = 5.0
"""A protective stop cannot be unlocked before so many seconds have passed."""


class Gripper(Protocol):
    """What closes and opens; such as `robotiq.RobotiqGripper`."""

    def opening(self) -> float:
        """0 closed .. 1 open; ConnectionError if it does not answer."""
        ...

    def move(self, opening: float, stopped: Callable[[], bool]) -> MotionResult:
        """As `Robot.move_gripper`, until `stopped` says so."""
        ...

    def close(self) -> None:
        """Give up the connection."""
        ...


class UniversalRobot:
    """An arm of Universal Robots with a gripper, as a `Robot`.

    A line is slowed to the limit of the turn as well; speeds of joints the controller does not limit on a
    line, so there only `GuardedRobot` watches over them. The controller's tool centre point is set to imop's
    gripper frame.

    Args:
        address: of the arm's controller.
        limits: how fast it may be.
        T_flange_gripper: (4, 4) of imop's gripper frame.
        gripper: on the flange.

    Raises:
        MissingExtra: without ur_rtde.
        ConnectionError: if the arm does not answer.
    """

    def __init__(self, address: str, limits: Limits, T_flange_gripper: FloatArray, gripper: Gripper) -> None:
        self._limits, self._gripper = limits, gripper
        self._tip = to_vector(as_pose("T_flange_gripper", T_flange_gripper))
        self._stop = threading.Event()
        self._stopped_since: float | None = None
        try:
            self._measured = RTDEReceiveInterface(address)
            self._control = RTDEControlInterface(address)
            self._dashboard = DashboardClient(address)
            self._dashboard.connect()
            self._control.setTcp(self._tip)
        except RuntimeError as error:
            raise ConnectionError(f"{address}: {error}") from error

    def state(self) -> RobotState:
        """As `Robot.state`."""
        if not self._measured.isConnected():
            raise ConnectionError("the arm does not answer")
        T = from_vector(self._measured.getActualTCPPose())
        q = np.asarray(self._measured.getActualQ())
        return RobotState(T, self._gripper.opening(), q, time.time())

    def move_to(
        self, T_base_gripper: FloatArray, *, straight: bool = False, allow_collisions: bool = False
    ) -> MotionResult:
        """As `Robot.move_to`, always along a line."""
        goal = as_pose("T_base_gripper", T_base_gripper)

        def go() -> MotionResult:
            target = to_vector(goal)
            if not self._control.isPoseWithinSafetyLimits(target):
                return MotionResult(False, "unreachable", "not within the arm's reach and safety limits")
            if not self._control.moveL(target, self._speed(goal), ACCELERATION, True):
                return MotionResult(False, "not_ready", "the controller does not accept the motion")
            return self._come_to(goal)

        return self._done(go)

    def move_gripper(self, opening: float) -> MotionResult:
        """As `Robot.move_gripper`."""
        wanted = as_fraction("opening", opening)
        return self._done(lambda: self._gripper.move(wanted, self._stop.is_set))

    def stop(self) -> None:
        """As `Robot.stop`."""
        self._stop.set()

    def recover(self) -> MotionResult:
        """Unlock a protective stop and upload the control program again; brakes stay as they are."""

        def go() -> MotionResult:
            if self._measured.isEmergencyStopped():
                return MotionResult(False, "not_ready", "emergency stop: release the button")
            if self._measured.isProtectiveStopped():
                since = self._stopped_since or time.monotonic()
                time.sleep(max(0.0, since + UNLOCK_AFTER - time.monotonic()))
                self._dashboard.closeSafetyPopup()
                self._dashboard.unlockProtectiveStop()
                self._stopped_since = None
            if not self._control.isConnected() and not self._control.reconnect():
                return MotionResult(False, "disconnected", "the controller does not answer")
            if not self._control.isProgramRunning() and not self._control.reuploadScript():
                return MotionResult(False, "not_ready", "the controller does not take the control program")
            self._control.setTcp(self._tip)
            return self._fault() or DONE

        return self._done(go)

    def close(self) -> None:
        """Stop, and give up the connections."""
        self.stop()
        self._control.stopScript()
        self._control.disconnect()
        self._measured.disconnect()
        self._dashboard.disconnect()
        self._gripper.close()

    def _speed(self, goal: FloatArray) -> float:
        """Of the line to a pose (4, 4), such that turning along it is not too fast either."""
        T = from_vector(self._measured.getActualTCPPose())
        way, turn = float(se3.translation_distance(T, goal)), float(se3.rotation_distance(T, goal))
        slowed = way / max(turn / self._limits.turn, 1e-9)
        return float(np.clip(slowed, min(SLOWEST, self._limits.speed), self._limits.speed))

    def _come_to(self, goal: FloatArray) -> MotionResult:
        """Wait until the arm rests."""
        moved = time.monotonic()
        while True:
            if fault := self._fault():
                return fault
            if self._stop.is_set():
                self._control.stopL(BRAKING)
                return MotionResult(False, "stopped", "stop was called")
            T = from_vector(self._measured.getActualTCPPose())
            if np.abs(self._measured.getActualTCPSpeed()).max() > AT_REST:
                moved = time.monotonic()
            elif se3.near(T, goal, *ARRIVED):
                return DONE
            elif time.monotonic() - moved > SETTLING:
                self._control.stopL(BRAKING)
                off = float(se3.translation_distance(T, goal))
                return MotionResult(False, "not_arrived", f"{off * 1000:.0f} mm away")
            time.sleep(POLL)

    def _fault(self) -> MotionResult | None:
        """What the controller stopped the arm for."""
        if not self._measured.isConnected():
            return MotionResult(False, "disconnected", "the arm does not answer")
        if self._measured.isEmergencyStopped():
            return MotionResult(False, "not_ready", "emergency stop")
        if self._measured.isProtectiveStopped():
            self._stopped_since = self._stopped_since or time.monotonic()
            return MotionResult(False, "protective_stop", "the arm's own safety stopped it")
        return None

    def _done(self, go: Callable[[], MotionResult]) -> MotionResult:
        self._stop.clear()
        try:
            return go()
        except (ConnectionError, RuntimeError) as error:
            return MotionResult(False, "disconnected", f"{error}")
