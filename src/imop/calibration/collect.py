"""Pictures of the board from a live robot: it goes from pose to pose, or somebody guides it."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from imop.calibration.board import Board
from imop.calibration.detect import detect_corners
from imop.calibration.folder import NAME, Recording, read_recording
from imop.calibration.series import BoardPlace, Mount, RigCamera
from imop.cameras.interfaces import Camera, Frame
from imop.errors import InvalidInput
from imop.geometry import se3
from imop.robots.interfaces import Robot, RobotState
from imop.types import FloatArray

REST = 0.0005, np.radians(0.05)
"""Metres and radians by which the hand may move while a picture is taken."""
REACH, TILT = 0.08, np.radians(20.0)
"""Metres and radians by which proposed poses differ from the one they are proposed around."""

What = Literal["stored", "not reached", "moved", "no board"]


@dataclass(frozen=True, eq=False)
class Rig:
    """A robot with its cameras, running.

    Attributes:
        robot: the arm.
        cameras: by name.
        mounts: where each camera is fixed; beside the robot if not said.
    """

    robot: Robot
    cameras: Mapping[str, Camera]
    mounts: Mapping[str, Mount] = field(default_factory=dict)

    def capture(self) -> dict[str, Frame]:
        """What all cameras see."""
        return {name: camera.capture() for name, camera in self.cameras.items()}


def start_recording(folder: Path, rig: Rig, board: Board, board_on: BoardPlace) -> Recording:
    """A new recording, or the one that is in the folder already, to be continued.

    Cameras that move with the board are left out, for they would see the same in all pictures.

    Raises:
        InvalidInput: if the recording in the folder is of another board, place or camera.
    """
    cameras = {}
    for name, frame in rig.capture().items():
        mount = rig.mounts.get(name, "world")
        if not (mount == "hand" and board_on == "hand"):
            height, width = frame.depth.shape
            cameras[name] = RigCamera(mount, width, height, frame.intrinsics)
    if not cameras:
        raise InvalidInput("cameras", "none that moves relative to the board", "a board on the table")
    if not (folder / NAME).exists():
        return Recording(folder, board, board_on, cameras)
    there = read_recording(folder)
    if (there.board, there.board_on, set(there.cameras)) != (board, board_on, set(cameras)):
        raise InvalidInput("folder", f"{folder} holds another board or other cameras", "a new folder")
    return there


def shoot(recording: Recording, rig: Rig) -> tuple[Recording, What]:
    """Take one shot where the arm is, unless it moves meanwhile or no camera sees the board."""
    before = rig.robot.state()
    frames = {name: rig.cameras[name].capture() for name in recording.cameras}
    after = rig.robot.state()
    if not _rests(before, after):
        return recording, "moved"
    if all(detect_corners(recording.board, frame.rgb) is None for frame in frames.values()):
        return recording, "no board"
    return recording.with_shot(after, frames), "stored"


def collect(
    recording: Recording,
    rig: Rig,
    poses: Iterable[FloatArray],
    count: int,
    say: Callable[[int, What, str], None] = lambda number, what, detail: None,
) -> Recording:
    """Go through poses (4, 4) T_base_gripper, and store what is seen there, until there are `count` shots.

    A pose that cannot be reached is left out, and the arm recovers from its error. Whatever interrupts it
    stops the arm.

    Args:
        recording: what is there already.
        rig: robot and cameras.
        poses: where to go.
        count: how many shots there shall be.
        say: told the number of each pose, what became of it, and why.
    """
    try:
        for number, T in enumerate(poses):
            if len(recording.shots) >= count:
                break
            result = rig.robot.move_to(T)
            if not result.done:
                say(number, "not reached", f"{result.reason} {result.detail}".strip())
                rig.robot.recover()
                continue
            recording, what = shoot(recording, rig)
            say(number, what, "")
    except BaseException:  # somebody pressed Ctrl-C, or a camera failed: the arm must not go on
        rig.robot.stop()
        raise
    return recording


def proposed_poses(
    T_base_gripper: FloatArray, rng: np.random.Generator, n: int, ahead: float = 0.0
) -> list[FloatArray]:
    """(4, 4) poses around one from which the board is seen: shifted, and turned about all axes.

    Args:
        T_base_gripper: (4, 4) where the board is seen well.
        rng: chooses.
        n: how many.
        ahead: metres before the fingers to the point about which the hand turns; for a camera on the hand
            about the board's distance, so that it stays in the picture.
    """
    to_pivot = se3.make(p=(0.0, 0.0, ahead))
    poses = []
    for _ in range(n):
        axis = rng.normal(size=3)
        axis *= TILT * rng.uniform(0.6, 1.2) / np.linalg.norm(axis)
        turn = se3.make(se3.euler(*axis), rng.uniform(-REACH, REACH, 3))
        poses.append(T_base_gripper @ to_pivot @ turn @ se3.invert(to_pivot))
    return poses


def _rests(before: RobotState, after: RobotState) -> bool:
    return bool(se3.near(before.T_base_gripper, after.T_base_gripper, *REST))
