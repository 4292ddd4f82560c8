"""What a calibration found, and its file."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from imop.calibration.board import Board
from imop.calibration.problems import Problem
from imop.calibration.refine import Poses
from imop.calibration.series import BoardPlace, Mount, RigCamera
from imop.errors import CorruptData, ImopError
from imop.files import read, replaced
from imop.geometry import se3
from imop.setup.file import intrinsics_fields, pose_fields, read_intrinsics, read_pose
from imop.types import FloatArray

FORMAT = "imop-calibration"
_REMEDY = "calibrate again with `imop calibrate solve`"


@dataclass(frozen=True)
class Quality:
    """How well a camera's pose is known.

    Attributes:
        pictures: in how many the board was seen.
        pixels: root of the mean square of the distances of corners from where they should be.
        worst_picture: name of the shot that fits worst.
        worst_pixels: median distance of its corners.
        millimetres: median distance between where the robot, through the calibration, and where the picture
            alone puts the board's corners.
        millimetres_off: standard error of the camera's position, by leaving out one picture after another.
        degrees_off: that of its rotation.
        spread_millimetres: how far the position moves at most if one picture is left out.
        spread_degrees: how far the rotation does.
        corner_pixels: standard deviation of a coordinate of a corner.
        common: by how many times errors that all corners of a picture have in common, such as the robot's,
            make the pose's variance larger than independent errors of the corners would.
    """

    pictures: int
    pixels: float
    worst_picture: str
    worst_pixels: float
    millimetres: float
    millimetres_off: float
    degrees_off: float
    spread_millimetres: float
    spread_degrees: float
    corner_pixels: float
    common: float


@dataclass(frozen=True, eq=False)
class CalibratedCamera:
    """A camera whose pose is known.

    Attributes:
        camera: mount, size, intrinsics and distortion.
        T_mount_camera: (4, 4) T_base_camera, or T_gripper_camera of a camera on the hand.
        quality: how well it is known.
    """

    camera: RigCamera
    T_mount_camera: FloatArray
    quality: Quality


@dataclass(frozen=True, eq=False)
class Calibration:
    """Where the cameras of a rig are.

    Attributes:
        cameras: name -> camera.
        board: what was looked at.
        board_on: where it was.
        T_place_board: (4, 4) T_gripper_board, or T_base_board of a board on the table.
        T_world_base: (4, 4) of the arm's base in the world of the Setup file.
        problems: warnings; errors are raised instead.
    """

    cameras: Mapping[str, CalibratedCamera]
    board: Board
    board_on: BoardPlace
    T_place_board: FloatArray
    T_world_base: FloatArray
    problems: Sequence[Problem] = ()

    @property
    def poses(self) -> Poses:
        """Of cameras and board."""
        return Poses({name: found.T_mount_camera for name, found in self.cameras.items()}, self.T_place_board)

    def T_world_camera(self, name: str, T_base_gripper: FloatArray) -> FloatArray:
        """Where a camera is (4, 4) when the gripper is at a pose (4, 4)."""
        found = self.cameras[name]
        if found.camera.mount == "hand":
            return self.T_world_base @ T_base_gripper @ found.T_mount_camera
        return self.T_world_base @ found.T_mount_camera


def save_calibration(calibration: Calibration, path: Path) -> None:
    """Write a JSON file, whose table `cameras` is that of a set-up file (`imop.setup`)."""
    content = {
        "format": FORMAT,
        "version": 1,
        "cameras": {name: _camera_fields(calibration, name) for name in calibration.cameras},
        "distortion": {name: c.camera.distortion.tolist() for name, c in calibration.cameras.items()},
        "T_world_base": pose_fields(calibration.T_world_base),
        "board": asdict(calibration.board),
        "board_on": calibration.board_on,
        "T_place_board": pose_fields(calibration.T_place_board),
        "quality": {name: asdict(found.quality) for name, found in calibration.cameras.items()},
        "problems": [asdict(problem) for problem in calibration.problems],
    }
    with replaced(path) as temporary:
        temporary.write_text(json.dumps(content, indent=2) + "\n")


def load_calibration(path: Path) -> Calibration:
    """Read what `save_calibration` wrote.

    Raises:
        CorruptData: if the file is missing or is none.
    """
    try:
        content = json.loads(read(path, _REMEDY))
        if content["format"] != FORMAT or content["version"] != 1:
            raise CorruptData(path, f"not a calibration of version 1 ({content.get('format')})", _REMEDY)
        T_world_base = read_pose(content["T_world_base"])
        cameras = {}
        for name, fields in content["cameras"].items():
            quality = Quality(**content["quality"][name])
            cameras[name] = _camera_of(fields, content["distortion"][name], T_world_base, quality)
        return Calibration(
            cameras,
            Board(**content["board"]),
            content["board_on"],
            read_pose(content["T_place_board"]),
            T_world_base,
            [Problem(**problem) for problem in content["problems"]],
        )
    except CorruptData:
        raise
    except (ImopError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise CorruptData(path, f"not a calibration ({type(error).__name__}: {error})", _REMEDY) from error


def _camera_fields(calibration: Calibration, name: str) -> dict[str, Any]:
    found = calibration.cameras[name]
    camera, K = found.camera, found.camera.intrinsics
    assert K is not None
    on_hand = camera.mount == "hand"
    T = found.T_mount_camera if on_hand else calibration.T_world_base @ found.T_mount_camera
    return {
        "intrinsics": intrinsics_fields(K),
        "size": [camera.width, camera.height],
        "T_gripper_camera" if on_hand else "T_world_camera": pose_fields(T),
    }


def _camera_of(
    fields: Mapping[str, Any], distortion: Sequence[float], T_world_base: FloatArray, quality: Quality
) -> CalibratedCamera:
    mount: Mount = "hand" if "T_gripper_camera" in fields else "world"
    width, height = fields["size"]
    camera = RigCamera(mount, width, height, read_intrinsics(fields["intrinsics"]), np.array(distortion))
    if mount == "hand":
        return CalibratedCamera(camera, read_pose(fields["T_gripper_camera"]), quality)
    T = se3.invert(T_world_base) @ read_pose(fields["T_world_camera"])
    return CalibratedCamera(camera, T, quality)
