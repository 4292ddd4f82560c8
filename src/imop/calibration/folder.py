"""Pictures and robot poses as a folder: PNG files and a series.json.

    series.json
    front/0000.png          what the camera `front` saw in shot 0
    front/0000_depth.png    its depth, 16 bit, if there is any

docs/real_robot/calibration.md shows series.json.
"""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation

from imop.calibration.board import Board
from imop.calibration.detect import detect_corners
from imop.calibration.result import Calibration
from imop.calibration.series import BoardPlace, RigCamera, Series, Shot
from imop.cameras.interfaces import Frame
from imop.demos.images import read_rgb
from imop.errors import CorruptData, InvalidInput
from imop.files import read, replaced
from imop.geometry import se3
from imop.robots.interfaces import RobotState
from imop.setup.file import intrinsics_fields, pose_fields, read_intrinsics, read_pose
from imop.setup.units import as_angles
from imop.types import (
    ByteArray,
    CameraView,
    Float32Array,
    FloatArray,
    Observation,
    as_finite,
    freeze,
)

FORMAT = "imop-calibration-series"
NAME = "series.json"
DEPTH_STEP = 0.001
"""Metres per step of a depth image."""
_REMEDY = "see docs/real_robot/calibration.md for the format, or record with `imop calibrate collect`"
_MOST_RADIANS = 2 * np.pi + 0.01


@dataclass(frozen=True, eq=False)
class Recorded:
    """One shot in a folder.

    Attributes:
        T_base_gripper: (4, 4).
        images: camera -> file, relative to the folder.
        depth: camera -> file of the depth, relative to the folder.
        joint_positions: (J,) radians, or None.
        gripper_opening: 0 closed .. 1 open.
    """

    T_base_gripper: FloatArray
    images: Mapping[str, str]
    depth: Mapping[str, str]
    joint_positions: FloatArray | None = None
    gripper_opening: float = 1.0

    @property
    def name(self) -> str:
        """What messages call it."""
        return next(iter(self.images.values()), "a shot without pictures")


@dataclass(frozen=True, eq=False)
class Recording:
    """A folder of pictures and robot poses.

    Attributes:
        folder: where it is.
        board: what was looked at.
        board_on: where it was.
        cameras: name -> what is known of it.
        shots: in the order in which they were taken.
    """

    folder: Path
    board: Board
    board_on: BoardPlace
    cameras: Mapping[str, RigCamera]
    shots: Sequence[Recorded] = ()

    def __post_init__(self) -> None:
        freeze(self, shots=tuple(self.shots))

    def rgb(self, shot: int, camera: str) -> ByteArray:
        """(H, W, 3) what a camera saw.

        Raises:
            CorruptData: if the file is missing or damaged.
            InvalidInput: if it has another size than the camera.
        """
        path, known = self.folder / self.shots[shot].images[camera], self.cameras[camera]
        image = read_rgb(path)
        if image.shape[:2] != (known.height, known.width):
            problem = f"{path} has {image.shape[1]} x {image.shape[0]} pixels"
            raise InvalidInput(
                f"cameras.{camera}.size", problem, f"{known.width} x {known.height}, as {NAME} says"
            )
        return image

    def depth(self, shot: int, camera: str) -> Float32Array | None:
        """(H, W) metres, or None if none was recorded."""
        name = self.shots[shot].depth.get(camera)
        if name is None:
            return None
        try:
            with Image.open(self.folder / name) as image:
                steps = np.asarray(image).astype(np.float32)
        except (OSError, ValueError) as error:
            raise CorruptData(self.folder / name, f"not a readable depth image ({error})") from error
        return steps * np.float32(DEPTH_STEP)

    def series(self, track: Callable[[Sequence[int]], Iterable[int]] = lambda numbers: numbers) -> Series:
        """Find the board in all pictures.

        Args:
            track: shows the progress.

        Raises:
            CorruptData, InvalidInput: for pictures that cannot be used.
            MissingExtra: without OpenCV.
        """
        shots = []
        for i in track(range(len(self.shots))):
            recorded, corners = self.shots[i], {}
            for camera in recorded.images:
                found = detect_corners(self.board, self.rgb(i, camera))
                if found is not None:
                    corners[camera] = found
            shots.append(Shot(recorded.T_base_gripper, corners, recorded.name))
        return Series(self.board, self.board_on, self.cameras, shots)

    def observations(self, calibration: Calibration) -> list[Observation]:
        """What was seen at each shot with depth images, with the poses of a calibration."""
        found = []
        for i, shot in enumerate(self.shots):
            views = {}
            for name in shot.images:
                depth, known = self.depth(i, name), calibration.cameras.get(name)
                if depth is not None and known is not None and known.camera.intrinsics is not None:
                    T = calibration.T_world_camera(name, shot.T_base_gripper)
                    views[name] = CameraView(self.rgb(i, name), depth, known.camera.intrinsics, T)
            if views:
                T_world_gripper = calibration.T_world_base @ shot.T_base_gripper
                opening, q = shot.gripper_opening, shot.joint_positions
                found.append(Observation(views, T_world_gripper, opening, i, q))
        return found

    def with_shot(self, state: RobotState, frames: Mapping[str, Frame]) -> "Recording":
        """Write one more shot: its pictures first, then series.json."""
        number = len(self.shots)
        images, depths = {}, {}
        for name, frame in frames.items():
            images[name], depths[name] = f"{name}/{number:04d}.png", f"{name}/{number:04d}_depth.png"
            with replaced(self.folder / images[name]) as temporary:
                Image.fromarray(frame.rgb).save(temporary, format="PNG")
            steps = np.nan_to_num(frame.depth / DEPTH_STEP, nan=0.0, posinf=0.0, neginf=0.0)
            with replaced(self.folder / depths[name]) as temporary:
                Image.fromarray(np.clip(np.round(steps), 0, 65535).astype(np.uint16)).save(
                    temporary, format="PNG"
                )
        shot = Recorded(state.T_base_gripper, images, depths, state.joint_positions, state.gripper_opening)
        recording = replace(self, shots=(*self.shots, shot))
        recording.write()
        return recording

    def write(self) -> None:
        """Write series.json."""
        content = {
            "format": FORMAT,
            "version": 1,
            "board": asdict(self.board),
            "board_on": self.board_on,
            "cameras": {name: _camera_fields(camera) for name, camera in self.cameras.items()},
            "shots": [_shot_fields(shot) for shot in self.shots],
        }
        with replaced(self.folder / NAME) as temporary:
            temporary.write_text(json.dumps(content, indent=2) + "\n")


def read_recording(folder: Path) -> Recording:
    """Read a folder of pictures and robot poses.

    Raises:
        CorruptData: if series.json is missing or no JSON.
        InvalidInput: for a field that is missing or cannot be, named as in the file.
    """
    path = folder / NAME
    try:
        content = json.loads(read(path, _REMEDY))
    except ValueError as error:
        raise CorruptData(path, f"not JSON ({error})", _REMEDY) from error
    if not isinstance(content, dict) or content.get("format") != FORMAT or content.get("version") != 1:
        raise CorruptData(path, f'does not begin with "format": "{FORMAT}" and "version": 1', _REMEDY)
    board = _parsed("board", lambda: Board(**content["board"]))
    described = _parsed("cameras", lambda: dict(content["cameras"]))
    cameras = {name: _parsed(f"cameras.{name}", partial(_camera, these)) for name, these in described.items()}
    listed = _parsed("shots", lambda: list(content["shots"]))
    shots = [_parsed(f"shots[{i}]", partial(_shot, these, cameras)) for i, these in enumerate(listed)]
    return Recording(folder, board, content.get("board_on", ""), cameras, shots)


def _parsed(field: str, parse: Callable[[], Any]) -> Any:
    """What `parse` gives; its errors name the field of the file."""
    try:
        return parse()
    except InvalidInput as error:
        raise InvalidInput(f"{NAME}: {field}.{error.field}", error.problem, error.accepted) from error
    except KeyError as error:
        raise InvalidInput(f"{NAME}: {field}", f"{error} is missing", _REMEDY) from error
    except (TypeError, ValueError, AttributeError) as error:
        raise InvalidInput(f"{NAME}: {field}", str(error), _REMEDY) from error


def _camera(fields: Mapping[str, Any]) -> RigCamera:
    width, height = fields["size"]
    K = read_intrinsics(fields["intrinsics"]) if fields.get("intrinsics") else None
    return RigCamera(
        fields["mount"], width, height, K, np.array(fields.get("distortion", []), dtype=np.float64)
    )


def _camera_fields(camera: RigCamera) -> dict[str, Any]:
    K = camera.intrinsics
    return {
        "mount": camera.mount,
        "size": [camera.width, camera.height],
        "intrinsics": None if K is None else intrinsics_fields(K),
        "distortion": camera.distortion.tolist(),
    }


def _shot(fields: Mapping[str, Any], cameras: Mapping[str, RigCamera]) -> Recorded:
    q = fields.get("joint_positions")
    images, depth = dict(fields["images"]), dict(fields.get("depth", {}))
    for name in (*images, *depth):
        if name not in cameras:
            raise InvalidInput("images", f"of a camera {name}", "one of " + ", ".join(cameras))
    q = None if q is None else as_angles("joint_positions", q)
    T = _pose(fields["T_base_gripper"])
    return Recorded(T, images, depth, q, float(fields.get("gripper_opening", 1.0)))


def _pose(fields: Any) -> FloatArray:
    """A pose as in set-up files, or as position with a rotation vector (radians)."""
    if not isinstance(fields, Mapping) or "rotation_vector" not in fields:
        return read_pose(fields)
    if set(fields) != {"position", "rotation_vector"}:
        accepted = "position, and either quaternion or rotation_vector"
        raise InvalidInput("T_base_gripper", ", ".join(fields), accepted)
    position = as_finite("position", fields["position"], (3,))
    turn = as_finite("rotation_vector", fields["rotation_vector"], (3,))
    if np.linalg.norm(turn) > _MOST_RADIANS:
        problem = f"a turn by {np.linalg.norm(turn):.0f}"
        raise InvalidInput("rotation_vector", problem, "radians, not degrees: at most a whole turn")
    return se3.make(Rotation.from_rotvec(turn.copy()).as_matrix(), position)


def _shot_fields(shot: Recorded) -> dict[str, Any]:
    fields: dict[str, Any] = {
        "T_base_gripper": pose_fields(shot.T_base_gripper),
        "gripper_opening": shot.gripper_opening,
        "images": dict(shot.images),
        "depth": dict(shot.depth),
    }
    if shot.joint_positions is not None:
        fields["joint_positions"] = shot.joint_positions.tolist()
    return fields
