"""Whether a real arm is where it was sent, once it has come to rest."""

import time

from imop.geometry import se3
from imop.robots.interfaces import DONE, MotionResult, Robot
from imop.types import FloatArray

ARRIVED = (0.005, 0.05)
"""An arm rests at most so far from its goal, metres and radians."""
SETTLING = 1.0
"""Seconds in which an arm comes to rest after its controller says that it has arrived."""
_PERIOD = 0.02


def arrived(robot: Robot, T_base_gripper: FloatArray) -> MotionResult:
    """Done, or "not_arrived" if the gripper does not come to a pose (4, 4) in time.

    Raises:
        ConnectionError: if the arm does not answer.
    """
    until = time.monotonic() + SETTLING
    while True:
        T = robot.state().T_base_gripper
        if se3.near(T, T_base_gripper, *ARRIVED):
            return DONE
        if time.monotonic() > until:
            off = float(se3.translation_distance(T, T_base_gripper))
            return MotionResult(False, "not_arrived", f"{off * 1000:.0f} mm away")
        time.sleep(_PERIOD)
