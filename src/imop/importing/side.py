"""The side file: what a recording of another program lacks, or does not say which of its parts is what.

A TOML or JSON file. All of it is optional; an importer names what it needs and does not find.
docs/real_robot/importing.md shows one.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from imop.errors import CorruptData, InvalidInput
from imop.files import read
from imop.recording.folder import RecordedCamera, read_camera
from imop.setup.file import MISSING, Table, file_format, read_names, read_pose, read_text
from imop.setup.setup import Setup
from imop.types import FloatArray

PoseFormat = Literal["xyzw", "wxyz", "rotation_vector", "matrix"]
"""Numbers of a pose: position and quaternion in one of two orders, or with a rotation vector; or 4 x 4."""


@dataclass(frozen=True, eq=False)
class SideCamera:
    """One camera.

    Attributes:
        rgb, depth: topics or features with its images.
        info: topic with its intrinsics.
        frame: tf frame of its images.
        known: what the recording does not say, or says wrongly.
    """

    rgb: str = ""
    depth: str = ""
    info: str = ""
    frame: str = ""
    known: RecordedCamera = field(default_factory=RecordedCamera)


@dataclass(frozen=True, eq=False)
class Side:
    """All of it.

    Attributes:
        cameras: by the name that demonstrations shall have.
        world: tf frame that is the world.
        joints: names of the arm's joints, in the order of the joint positions.
        degrees: whether joints are recorded in degrees.
        fingers: joint or number of the state -> its value when closed, and when open.
        frame: tf frame of the gripper.
        pose: feature with the gripper's pose in the world.
        pose_format: of its numbers.
        T_frame_gripper: (4, 4) from that frame or pose to imop's gripper frame.
        setup: the set-up of the cell, whose cameras and arm say what nothing else says; or None.
    """

    cameras: Mapping[str, SideCamera] = field(default_factory=dict)
    world: str = ""
    joints: tuple[str, ...] = ()
    degrees: bool = False
    fingers: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    frame: str = ""
    pose: str = ""
    pose_format: PoseFormat = "xyzw"
    T_frame_gripper: FloatArray = field(default_factory=lambda: np.eye(4))
    setup: Setup | None = None

    @property
    def chooses(self) -> bool:
        """Whether it says which images are whose; else cameras are found by the names of their images."""
        return any(camera.rgb or camera.depth for camera in self.cameras.values())

    def require_names(self, found: Iterable[str]) -> None:
        """Refuse cameras that a recording does not have.

        Raises:
            InvalidInput: for the first of them.
        """
        there = list(found)
        for name in self.cameras:
            if name not in there:
                accepted = f"{', '.join(there)}; or rgb and depth of every camera"
                raise InvalidInput(f"cameras.{name}", "no such camera in the recording", accepted)

    def camera(self, name: str, recorded: RecordedCamera) -> RecordedCamera:
        """What is known of a camera: by this file, then by the recording, then by the set-up."""
        mine = self.cameras[name].known if name in self.cameras else RecordedCamera()
        fields = [mine, recorded, self._of_setup(name)]
        placed = [c for c in fields if c.T_world_camera is not None or c.T_gripper_camera is not None]
        place = placed[0] if placed else RecordedCamera()
        K = [c.intrinsics for c in fields if c.intrinsics is not None]
        scale = [c.depth_scale for c in fields if c.depth_scale is not None]
        return replace(place, intrinsics=K[0] if K else None, depth_scale=scale[0] if scale else None)

    def _of_setup(self, name: str) -> RecordedCamera:
        known = {} if self.setup is None else self.setup.cameras
        for other, camera in known.items():
            if name in (other, camera.seen_as):
                return RecordedCamera(camera.intrinsics, None, camera.T_world_camera, camera.T_gripper_camera)
        return RecordedCamera()


def read_side(path: Path | None, setup: Setup | None = None) -> Side:
    """Read a side file; without one, nothing is known but the set-up.

    Raises:
        CorruptData: if the file is missing, or neither TOML nor JSON.
        InvalidInput: for a field that is unknown or cannot be, named as in the file.
    """
    if path is None:
        return Side(setup=setup)
    content = read(path, "write one, see docs/real_robot/importing.md").decode(errors="replace")
    try:
        fields = file_format(path, "side").loads(content)
    except ValueError as error:
        if isinstance(error, InvalidInput):
            raise
        raise CorruptData(path, f"cannot be read ({error})", "mend what is said there") from error
    return replace(_side(fields), setup=setup)


def _side(fields: Mapping[str, Any]) -> Side:
    top = Table("", fields)
    gripper, cameras = top.table("gripper", optional=True), top.table("cameras", optional=True)
    values = {
        "world": top.take("world", read_text, "a tf frame"),
        "joints": top.take("joints", read_names, "a list of names"),
        "degrees": top.take("degrees", _truth, "true or false"),
        "fingers": gripper.take("fingers", _ranges, "a table of joints, each with [closed, open]"),
        "frame": gripper.take("frame", read_text, "a tf frame"),
        "pose": gripper.take("pose", read_text, "a feature"),
        "pose_format": gripper.take("pose_format", _pose_format, ", ".join(get_args(PoseFormat))),
        "T_frame_gripper": gripper.take("T_frame_gripper", read_pose),
    }
    top.end()
    gripper.end()
    known = {name: _camera(cameras.table(name)) for name in cameras.names()}
    return Side(known, **{name: value for name, value in values.items() if value is not MISSING})


def _camera(table: Table) -> SideCamera:
    names = {name: table.take(name, read_text, "a text") for name in ("rgb", "depth", "info", "frame")}
    rest = {name: table.take(name, lambda value: value) for name in table.names()}
    try:
        known = read_camera(rest)
    except InvalidInput as error:
        accepted = (
            error.accepted if error.problem != "unknown" else f"rgb, depth, info, frame, {error.accepted}"
        )
        raise InvalidInput(table.field(error.field), error.problem, accepted) from error
    return SideCamera(**{n: v for n, v in names.items() if v is not MISSING}, known=known)


def _truth(value: Any) -> bool:
    if not isinstance(value, bool):
        raise TypeError
    return value


def _pose_format(value: Any) -> str:
    if value not in get_args(PoseFormat):
        raise ValueError
    return str(value)


def _ranges(value: Any) -> dict[str, tuple[float, float]]:
    ranges = {str(name): (float(both[0]), float(both[1])) for name, both in dict(value).items()}
    if any(closed == opened for closed, opened in ranges.values()):
        raise ValueError
    return ranges
