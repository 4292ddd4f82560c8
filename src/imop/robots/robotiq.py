"""A gripper of Robotiq (2F-85, 2F-140, Hand-E) at an arm of Universal Robots, through the URCap's socket.

The URCap answers lines of text: "SET POS 255" with "ack", "GET POS" with "POS 255". Positions are 0 open to
255 closed.
"""

import socket
import threading
import time
from collections.abc import Callable

import numpy as np

from imop.robots.interfaces import DONE, MotionResult

PORT = 63352
SPEED, FORCE = 128, 64
"""Of 255."""
POLL, TIMEOUT = 0.05, 5.0
"""Seconds between two looks, and in which the fingers have to come to rest."""
_MOVING = 0
_ACTIVE = 3


class RobotiqGripper:
    """One gripper; it is activated, which moves the fingers, unless it is active.

    Args:
        address: of the arm's controller.
        port: of the URCap.

    Raises:
        ConnectionError: if it does not answer, or does not become active.
    """

    def __init__(self, address: str, port: int = PORT) -> None:
        # Who watches a motion asks for the opening while the fingers move.
        self._asking = threading.Lock()
        try:
            self._socket = socket.create_connection((address, port), timeout=2.0)
        except OSError as error:
            raise ConnectionError(f"gripper at {address}:{port}: {error}") from error
        if self._get("STA") != _ACTIVE:
            self._set("ACT", 0)
            self._set("ACT", 1)
            if not _until(lambda: self._get("STA") == _ACTIVE):
                raise ConnectionError("the gripper does not become active")

    def opening(self) -> float:
        """0 closed .. 1 open."""
        return 1.0 - self._get("POS") / 255

    def move(self, opening: float, stopped: Callable[[], bool]) -> MotionResult:
        """Bring the fingers to an opening, or to what stops them."""
        position = int(np.round(255 * (1.0 - opening)))
        for name, value in (("SPE", SPEED), ("FOR", FORCE), ("POS", position), ("GTO", 1)):
            self._set(name, value)
        # The gripper takes note of a request before it says that it moves.
        if not _until(lambda: stopped() or self._get("PRE") == position):
            return MotionResult(False, "not_ready", "the gripper does not take the request")
        resting = _until(lambda: stopped() or self._get("OBJ") != _MOVING)
        if stopped() or not resting:
            self._set("GTO", 0)
            if stopped():
                return MotionResult(False, "stopped", "stop was called")
            return MotionResult(False, "not_arrived", "the fingers do not come to rest")
        return DONE

    def close(self) -> None:
        """Give up the connection."""
        self._socket.close()

    def _get(self, name: str) -> int:
        answer = self._ask(f"GET {name}")
        told, _, value = answer.partition(" ")
        if told != name or not value.isdigit():
            raise ConnectionError(f"the gripper answers {answer!r} to GET {name}")
        return int(value)

    def _set(self, name: str, value: int) -> None:
        answer = self._ask(f"SET {name} {value}")
        if answer != "ack":
            raise ConnectionError(f"the gripper answers {answer!r} to SET {name} {value}")

    def _ask(self, line: str) -> str:
        try:
            with self._asking:
                self._socket.sendall(f"{line}\n".encode())
                return self._socket.recv(1024).decode(errors="replace").strip()
        except OSError as error:
            raise ConnectionError(f"the gripper does not answer: {error}") from error


def _until(true: Callable[[], bool]) -> bool:
    """Whether it becomes true in time."""
    end = time.monotonic() + TIMEOUT
    while not true():
        if time.monotonic() > end:
            return False
        time.sleep(POLL)
    return True
