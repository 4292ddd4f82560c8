"""A recording as a folder: a JSON file about it, one line per frame, and images.

    recording.json          format, cameras, task, instructions, kind
    frames.jsonl            a line per frame, appended while recording
    front/000000.png        what the camera `front` saw in frame 0
    front/000000_depth.png  its depth, 16 bit
    keyframes.json          the keyframes, once the recording has ended

docs/real_robot/recording.md shows the files. Whoever has images and a list of poses can write such a folder;
frames may then stand in recording.json as well.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from imop.errors import CorruptData, InvalidInput
from imop.files import read, replaced
from imop.recording.images import read_color, read_depth
from imop.recording.motion import Motion
from imop.setup.file import intrinsics_fields, pose_fields, read_intrinsics, read_pose
from imop.types import CameraView, FloatArray, Observation, as_finite

FORMAT = "imop-recording"
VERSION = 1
NAME, FRAMES, KEYFRAMES = "recording.json", "frames.jsonl", "keyframes.json"
_REMEDY = "see docs/real_robot/recording.md for the format"
_SCALE = "metres per unit of the depth images: 0.001 for millimetres, 1.0 for metres"
_POSE = "{position: [x, y, z], quaternion: [x, y, z, w]} in metres, or four rows of four numbers"


@dataclass(frozen=True, eq=False)
class RecordedCamera:
    """What is known of a camera; what is None has to be said before a demonstration is made of its images.

    Attributes:
        intrinsics: (3, 3) pixels.
        depth_scale: metres per unit of the depth images.
        T_world_camera: (4, 4) of a camera that stands.
        T_gripper_camera: (4, 4) of a camera on the gripper.
    """

    intrinsics: FloatArray | None = None
    depth_scale: float | None = None
    T_world_camera: FloatArray | None = None
    T_gripper_camera: FloatArray | None = None

    def require(self, name: str) -> None:
        """Refuse a camera of which something is missing.

        Raises:
            InvalidInput: for the first field that is missing.
        """
        if self.intrinsics is None:
            accepted = "{fx, fy, cx, cy} in pixels, or three rows of three numbers"
            raise InvalidInput(f"cameras.{name}.intrinsics", "missing", accepted)
        if self.depth_scale is None:
            raise InvalidInput(f"cameras.{name}.depth_scale", "missing", _SCALE)
        if self.T_world_camera is None and self.T_gripper_camera is None:
            accepted = f"{_POSE}; T_gripper_camera of a camera on the gripper (imop calibrate finds both)"
            raise InvalidInput(f"cameras.{name}.T_world_camera", "missing", accepted)

    def view(self, name: str, rgb: Any, depth: Any, T_world_gripper: FloatArray) -> CameraView:
        """What it saw while the gripper was at a pose (4, 4).

        Raises:
            InvalidInput: if something is missing, or the images do not belong together.
        """
        self.require(name)
        assert self.intrinsics is not None and self.depth_scale is not None
        if self.T_gripper_camera is not None:
            T = T_world_gripper @ self.T_gripper_camera
        else:
            assert self.T_world_camera is not None
            T = self.T_world_camera
        if np.shape(rgb)[:2] != np.shape(depth):
            problem = f"has {np.shape(depth)} pixels, its colours have {np.shape(rgb)[:2]}"
            raise InvalidInput(f"cameras.{name}.depth", problem, "depth that is aligned to the colours")
        try:
            return CameraView(rgb, np.asarray(depth, np.float32) * self.depth_scale, self.intrinsics, T)
        except InvalidInput as error:
            raise InvalidInput(f"cameras.{name}.{error.field}", error.problem, error.accepted) from error


@dataclass(frozen=True, eq=False)
class Recorded:
    """One frame.

    Attributes:
        stamp: seconds.
        T_world_gripper: (4, 4).
        gripper_opening: 0 closed .. 1 open.
        joint_positions: (J,) radians, or None.
        rgb, depth: camera -> file, relative to the folder; of an array in an .npz file, "file.npz:name".
    """

    stamp: float
    T_world_gripper: FloatArray
    gripper_opening: float
    joint_positions: FloatArray | None
    rgb: Mapping[str, str]
    depth: Mapping[str, str]

    def fields(self) -> dict[str, Any]:
        """As a line of the file has it."""
        q = self.joint_positions
        return {
            "stamp": self.stamp,
            "T_world_gripper": pose_fields(self.T_world_gripper),
            "gripper_opening": self.gripper_opening,
            **({} if q is None else {"joint_positions": q.tolist()}),
            "rgb": dict(self.rgb),
            "depth": dict(self.depth),
        }


@dataclass(frozen=True, eq=False)
class RecordedFolder:
    """A recording on disk: a `Source`.

    Attributes:
        folder: where it is.
        cameras: by name.
        frames: in the order in which they were recorded.
        task: for bookkeeping.
        instructions: the task in words.
        kind: how it was shown: kinesthetic, teleoperated, scripted, or anything else.
        origin: what it is a recording of, as far as a program knows; only the same is continued.
    """

    folder: Path
    cameras: Mapping[str, RecordedCamera]
    frames: Sequence[Recorded] = ()
    task: str = ""
    instructions: tuple[str, ...] = ()
    kind: str = ""
    origin: Mapping[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """What messages call it."""
        return str(self.folder)

    @cached_property
    def motion(self) -> Motion:
        """What the arm did.

        Raises:
            InvalidInput: for too few frames, times that do not increase, or joints that come and go.
        """
        joints = [frame.joint_positions for frame in self.frames]
        sizes = {None if q is None else len(q) for q in joints}
        if len(sizes) > 1:
            raise InvalidInput(
                "joint_positions", "not of one number in all frames", "as many joints in each frame, or none"
            )
        return Motion(
            np.array([frame.stamp for frame in self.frames]),
            np.array([frame.T_world_gripper for frame in self.frames]).reshape(-1, 4, 4),
            np.array([frame.gripper_opening for frame in self.frames]),
            None if None in sizes or not joints else np.array(joints),
        )

    def observation(self, frame: int, time_step: int = 0) -> Observation:
        """As `Source.observation`."""
        found = self.frames[frame]
        for name, camera in self.cameras.items():
            camera.require(name)
            for kind, files in (("rgb", found.rgb), ("depth", found.depth)):
                if name not in files:
                    accepted = "a file of every camera in every frame"
                    raise InvalidInput(f"frames[{frame}].{kind}.{name}", "missing", accepted)
        views = {
            name: camera.view(
                name,
                read_color(self.folder, found.rgb[name], frame),
                read_depth(self.folder, found.depth[name], frame),
                found.T_world_gripper,
            )
            for name, camera in self.cameras.items()
        }
        opening, q = found.gripper_opening, found.joint_positions
        return Observation(views, found.T_world_gripper, opening, time_step, q)

    def write(self) -> None:
        """Write recording.json; the frames are appended by `recorder.py`."""
        content = {
            "format": FORMAT,
            "version": VERSION,
            "task": self.task,
            "instructions": list(self.instructions),
            "kind": self.kind,
            "origin": dict(self.origin),
            "cameras": {name: _camera_fields(camera) for name, camera in self.cameras.items()},
        }
        with replaced(self.folder / NAME) as temporary:
            temporary.write_text(json.dumps(content, indent=2) + "\n")


def is_recording(folder: Path) -> bool:
    """Whether there is a recording in a folder."""
    return (folder / NAME).is_file()


def read_folder(folder: Path) -> RecordedFolder:
    """Read a recording; images are read when they are asked for.

    A last line of frames.jsonl that was cut off belongs to a frame that was not finished, and is left out.

    Raises:
        CorruptData: if a file is missing or no JSON.
        InvalidInput: for a field that is missing or cannot be, named as in the file.
    """
    path = folder / NAME
    try:
        content = json.loads(read(path, _REMEDY))
    except ValueError as error:
        raise CorruptData(path, f"not JSON ({error})", _REMEDY) from error
    if not isinstance(content, dict) or (content.get("format"), content.get("version")) != (FORMAT, VERSION):
        raise CorruptData(path, f'does not have "format": "{FORMAT}" and "version": {VERSION}', _REMEDY)
    described = content.get("cameras")
    if not isinstance(described, dict) or not described:
        raise InvalidInput(f"{NAME}: cameras", "missing", "a table of cameras by name")
    cameras = {
        str(name): parsed(f"{NAME}: cameras.{name}", partial(read_camera, fields))
        for name, fields in described.items()
    }
    lines = [(f"{NAME}: frames[{i}]", one) for i, one in enumerate(content.get("frames", ()))]
    lines += [(f"{FRAMES}, line {i + 1}", one) for i, one in enumerate(_lines(folder / FRAMES))]
    frames = [parsed(where, partial(_frame, fields, cameras)) for where, fields in lines]
    words = content.get("instructions", [])
    return RecordedFolder(
        folder,
        cameras,
        frames,
        str(content.get("task", "")),
        (words,) if isinstance(words, str) else tuple(str(one) for one in words),
        str(content.get("kind", "")),
        parsed(f"{NAME}: origin", lambda: dict(content.get("origin", {}))),
    )


def whole_lines(path: Path) -> bytes:
    """The content of a file up to the end of its last whole line; nothing if it does not exist."""
    content = path.read_bytes() if path.is_file() else b""
    return content[: content.rfind(b"\n") + 1]


def _lines(path: Path) -> list[Any]:
    found = []
    for number, line in enumerate(whole_lines(path).splitlines()):
        try:
            found.append(json.loads(line))
        except ValueError as error:
            problem = f"line {number + 1} is not JSON ({error})"
            raise CorruptData(path, problem, "remove the line, or record it again") from error
    return found


def parsed(where: str, parse: Callable[[], Any]) -> Any:
    """What `parse` gives; its errors name the place in the file.

    Raises:
        InvalidInput: for a field that is missing or cannot be.
    """
    try:
        return parse()
    except InvalidInput as error:
        raise InvalidInput(f"{where}.{error.field}", error.problem, error.accepted) from error
    except KeyError as error:
        raise InvalidInput(f"{where}.{error.args[0]}", "missing", _REMEDY) from error
    except (TypeError, ValueError, AttributeError) as error:
        raise InvalidInput(where, str(error), _REMEDY) from error


def read_camera(fields: Mapping[str, Any]) -> RecordedCamera:
    """A camera of what stands in a file.

    Raises:
        InvalidInput: for a field that is unknown or cannot be.
    """
    readers: dict[str, Callable[[Any], Any]] = {
        "intrinsics": read_intrinsics,
        "depth_scale": _scale,
        "T_world_camera": read_pose,
        "T_gripper_camera": read_pose,
    }
    for name in fields:
        if name not in readers:
            raise InvalidInput(name, "unknown", ", ".join(readers))
    if {"T_world_camera", "T_gripper_camera"} <= set(fields):
        raise InvalidInput("T_world_camera", "given beside T_gripper_camera", "one of the two")
    values = {}
    for name, value in fields.items():
        try:
            values[name] = None if value is None else readers[name](value)
        except InvalidInput as error:
            raise InvalidInput(name, error.problem, error.accepted) from error
    return RecordedCamera(**values)


def _scale(value: Any) -> float:
    scale = float(as_finite("depth_scale", value, ()))
    if not 1e-6 <= scale <= 1.0:
        raise InvalidInput("depth_scale", f"{scale:g}", _SCALE)
    return scale


def _camera_fields(camera: RecordedCamera) -> dict[str, Any]:
    fields: dict[str, Any] = {}
    if camera.intrinsics is not None:
        fields["intrinsics"] = intrinsics_fields(camera.intrinsics)
    if camera.depth_scale is not None:
        fields["depth_scale"] = camera.depth_scale
    for name in ("T_world_camera", "T_gripper_camera"):
        if getattr(camera, name) is not None:
            fields[name] = pose_fields(getattr(camera, name))
    return fields


def _frame(fields: Mapping[str, Any], cameras: Mapping[str, RecordedCamera]) -> Recorded:
    rgb, depth, q = dict(fields["rgb"]), dict(fields["depth"]), fields.get("joint_positions")
    for kind, files in (("rgb", rgb), ("depth", depth)):
        for name in files:
            if name not in cameras:
                raise InvalidInput(f"{kind}.{name}", "unknown camera", ", ".join(cameras))
    return Recorded(
        float(as_finite("stamp", fields["stamp"], ())),
        _named("T_world_gripper", lambda: read_pose(fields["T_world_gripper"])),
        float(as_finite("gripper_opening", fields["gripper_opening"], ())),
        None if q is None else as_finite("joint_positions", q, (None,)),
        rgb,
        depth,
    )


def _named(field_name: str, parse: Callable[[], FloatArray]) -> FloatArray:
    try:
        return parse()
    except InvalidInput as error:
        raise InvalidInput(field_name, error.problem, error.accepted) from error
