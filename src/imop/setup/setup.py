"""The set-up: arm, gripper, workspace, limits and cameras, validated when it is made.

It is written and read by `setup/file.py`. Nothing of it is known anywhere else: a policy, a driver and a
check take what they need from here.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from imop.cameras.interfaces import Frame
from imop.errors import InvalidInput
from imop.geometry import se3
from imop.geometry.perception import Perception, RobotMask
from imop.robots import ARMS, arm_name
from imop.robots.interfaces import RobotState
from imop.robots.limits import Limits
from imop.setup.units import as_angles, as_box, as_direction, as_length, as_place
from imop.types import FloatArray, Observation, as_array, as_intrinsics, freeze

ROBOT_DRIVERS = ("franka", "universal_robots", "simulated")
CAMERA_DRIVERS = ("realsense", "simulated")


@dataclass(frozen=True, eq=False)
class RobotSetup:
    """The arm.

    Attributes:
        model: one of `robots.ARMS`, or the path of an MJCF (.xml) or URDF (.urdf) file; a path is relative
            to the set-up file.
        home: (J,) radians, where an episode begins; J is the number of joints everywhere else.
        T_world_base: (4, 4), where the model's base stands.
        joints: names of the arm's joints in the model, in the order of the joint positions; needed if the
            model is a file.
        driver: what moves it, one of `ROBOT_DRIVERS`; empty if imop does not.
        address: of the arm's controller, such as 192.168.1.10, if the driver needs one.
    """

    model: str
    home: FloatArray
    T_world_base: FloatArray = field(default_factory=lambda: np.eye(4))
    joints: tuple[str, ...] = ()
    driver: str = ""
    address: str = ""

    def __post_init__(self) -> None:
        freeze(
            self,
            model=arm_name(self.model),
            home=as_angles("robot.home", self.home),
            T_world_base=as_place("robot.T_world_base", self.T_world_base),
            joints=tuple(self.joints),
        )
        if not self.model:
            raise InvalidInput("robot.model", "empty", f"a file, or one of {', '.join(ARMS)}")
        if self.known and self.joints:
            accepted = f"no names, for imop knows those of {self.model}"
            raise InvalidInput("robot.joints", ", ".join(self.joints), accepted)
        if not self.known and len(self.joints) != len(self.home):
            problem = f"{len(self.joints)} names, but home has {len(self.home)} positions"
            raise InvalidInput("robot.joints", problem, "the name of each joint of the arm, in order")
        _known_driver("robot.driver", self.driver, ROBOT_DRIVERS)

    @property
    def known(self) -> bool:
        """Whether the model is one of `robots.ARMS`."""
        return self.model in ARMS


@dataclass(frozen=True, eq=False)
class GripperSetup:
    """A parallel gripper and where its tip is.

    Attributes:
        stroke: metres between the open fingers.
        tip: (3,) metres, the middle between the finger ends, in the frame of the flange.
        approach: (3,) direction in which the fingers point, in the frame of the flange.
        closing: (3,) direction in which the fingers close, in the frame of the flange; its sign does not
            matter.
        flange: body or site of the model that `tip` is measured from; needed if the model is a file. It
            should be the frame that the arm's controller reports.
        fingers: joint of the model -> its position when closed, and when open (metres or radians).
    """

    stroke: float
    tip: FloatArray
    approach: FloatArray = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    closing: FloatArray = field(default_factory=lambda: np.array([0.0, 1.0, 0.0]))
    flange: str = ""
    fingers: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        approach = as_direction("gripper.approach", self.approach)
        closing = as_direction("gripper.closing", self.closing)
        if abs(approach @ closing) > 0.01:
            raise InvalidInput("gripper.closing", "not at right angles to approach", "two such directions")
        ranges = {n: _range(f"gripper.fingers.{n}", r) for n, r in self.fingers.items()}
        freeze(
            self,
            stroke=as_length("gripper.stroke", self.stroke, 0.5),
            tip=as_box("gripper.tip", self.tip),
            approach=approach,
            closing=closing,
            fingers=ranges,
        )

    @property
    def T_flange_gripper(self) -> FloatArray:
        """(4, 4): imop's gripper frame, +z the approach direction and y the closing direction."""
        x = np.cross(self.closing, self.approach)
        R = np.stack([x, np.cross(self.approach, x), self.approach], axis=1)
        return se3.orthonormal(se3.make(R, self.tip))


@dataclass(frozen=True, eq=False)
class WorkspaceSetup:
    """Where things may be, and where the gripper may go.

    Attributes:
        lower, upper: (3,) metres, world frame.
        table_height: metres, world frame; between the two.
    """

    lower: FloatArray
    upper: FloatArray
    table_height: float

    def __post_init__(self) -> None:
        lower, upper = as_box("workspace.lower", self.lower), as_box("workspace.upper", self.upper)
        if np.any(lower >= upper):
            axes = " and ".join(a for a, low, up in zip("xyz", lower, upper, strict=True) if low >= up)
            problem = f"{lower.tolist()} is not below upper, {upper.tolist()}, in {axes}"
            raise InvalidInput("workspace.lower", problem, "lower < upper in x, y and z, metres")
        height = float(as_box("workspace.table_height", np.full(3, self.table_height))[0])
        if not lower[2] < height < upper[2]:
            accepted = f"between the z of lower and of upper, {lower[2]:g} and {upper[2]:g} m"
            raise InvalidInput("workspace.table_height", f"{height:g} m", accepted)
        freeze(self, lower=lower, upper=upper, table_height=height)

    def perception(self, robot_mask: RobotMask | None, **options: Any) -> Perception:
        """What makes clouds of what is in it; for `options` see `Perception`."""
        lower, upper = (tuple(p.tolist()) for p in (self.lower, self.upper))
        return Perception(robot_mask, lower=lower, upper=upper, **options)


@dataclass(frozen=True, eq=False)
class CameraSetup:
    """One camera: beside the arm, or mounted on the gripper.

    Attributes:
        intrinsics: (3, 3) pixels.
        size: width and height of its images, pixels.
        T_world_camera: (4, 4) if it stands beside the arm, else None. x right, y down, z forward.
        T_gripper_camera: (4, 4) if it moves with the gripper, else None.
        seen_as: what the demonstrations call it, where that is another name than here.
        driver: what it is read with, one of `CAMERA_DRIVERS`; empty if imop does not read it.
        serial: number of the camera, by which the driver finds it.
    """

    intrinsics: FloatArray
    size: tuple[int, int]
    T_world_camera: FloatArray | None = None
    T_gripper_camera: FloatArray | None = None
    seen_as: str = ""
    driver: str = ""
    serial: str = ""

    def __post_init__(self) -> None:
        given = [n for n in ("T_world_camera", "T_gripper_camera") if getattr(self, n) is not None]
        if len(given) != 1:
            accepted = "T_world_camera of a camera that stands, or T_gripper_camera of one on the gripper"
            raise InvalidInput("T_world_camera", " and ".join(given) or "missing", accepted)
        K = as_intrinsics("intrinsics", self.intrinsics)
        width, height = as_array("size", self.size, (2,), np.int32).tolist()
        if width < 1 or height < 1:
            raise InvalidInput("size", f"{self.size}", "width and height in pixels")
        if not (0 < K[0, 2] < width and 0 < K[1, 2] < height):
            problem = f"({K[0, 2]:g}, {K[1, 2]:g}) is outside of an image of {width} x {height} pixels"
            raise InvalidInput("intrinsics", problem, "cx and cy inside of the image; size is width, height")
        _known_driver("driver", self.driver, CAMERA_DRIVERS)
        place = as_place(given[0], getattr(self, given[0]))
        freeze(self, intrinsics=K, size=(width, height), **{given[0]: place})

    @property
    def on_gripper(self) -> bool:
        """Whether it moves with the gripper."""
        return self.T_gripper_camera is not None

    def pose(self, T_world_gripper: FloatArray) -> FloatArray:
        """T_world_camera (4, 4) while the gripper is at a pose (4, 4)."""
        if self.T_gripper_camera is None:
            assert self.T_world_camera is not None
            return self.T_world_camera
        return np.asarray(T_world_gripper @ self.T_gripper_camera)


@dataclass(frozen=True, eq=False)
class Part:
    """A box that is mounted on the gripper and belongs to the robot, such as a camera.

    Attributes:
        size: (3,) metres, whole lengths of its edges.
        T_gripper_part: (4, 4), of its middle.
    """

    size: FloatArray
    T_gripper_part: FloatArray

    def __post_init__(self) -> None:
        size = as_box("size", self.size)
        if np.any(size <= 0):
            raise InvalidInput("size", f"{size.tolist()}", "three lengths above 0, metres")
        freeze(self, size=size, T_gripper_part=as_place("T_gripper_part", self.T_gripper_part))


@dataclass(frozen=True, eq=False)
class Setup:
    """All of it.

    Attributes:
        robot, workspace, limits: see there.
        gripper: None if the robot's model is one of `robots.ARMS`, which imop knows with their gripper.
        cameras: by the names that their drivers have.
        parts: what is mounted on the gripper, by name.

    Raises:
        InvalidInput: for a value that cannot be, named as in the file: "cameras.front.intrinsics".
    """

    robot: RobotSetup
    workspace: WorkspaceSetup
    cameras: Mapping[str, CameraSetup]
    gripper: GripperSetup | None = None
    limits: Limits = field(default_factory=Limits)
    parts: Mapping[str, Part] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.cameras:
            raise InvalidInput("cameras", "none", "at least one table [cameras.NAME]")
        names = [camera.seen_as or name for name, camera in self.cameras.items()]
        if len(set(names)) < len(names):
            raise InvalidInput("cameras", f"two are seen as one of {', '.join(names)}", "a name for each")
        if self.robot.known and self.gripper is not None:
            accepted = f"no table [gripper], for imop knows that of {self.robot.model}; or a file as model"
            raise InvalidInput("gripper", "given", accepted)
        if not self.robot.known and (self.gripper is None or not self.gripper.flange):
            raise InvalidInput(
                "gripper.flange", "missing", "a body or site of the model, in a table [gripper]"
            )
        freeze(self, cameras=dict(self.cameras), parts=dict(self.parts))

    def T_world_gripper(self, state: RobotState) -> FloatArray:
        """(4, 4): the measured pose of the gripper in the world."""
        return np.asarray(self.robot.T_world_base @ state.T_base_gripper)

    def observation(self, state: RobotState, frames: Mapping[str, Frame], time_step: int = 0) -> Observation:
        """What is seen and measured at one moment, as a policy takes it.

        Args:
            state: of the arm.
            frames: by the names of the cameras, each of the size that its camera has.
            time_step: number of keyframes reached so far in this episode.

        Raises:
            InvalidInput: if a camera is missing or unknown, its images have another size, or the number of
                joints is another.
        """
        if set(frames) != set(self.cameras):
            raise InvalidInput("frames", ", ".join(sorted(frames)), ", ".join(sorted(self.cameras)))
        if len(state.joint_positions) != len(self.robot.home):
            problem = f"{len(state.joint_positions)} of them"
            raise InvalidInput("joint_positions", problem, f"{len(self.robot.home)}, as home has")
        T_world_gripper, views = self.T_world_gripper(state), {}
        for name, camera in self.cameras.items():
            height, width = frames[name].depth.shape
            if (width, height) != camera.size:
                accepted = f"{camera.size[0]} x {camera.size[1]}, as the set-up says"
                raise InvalidInput(f"frames.{name}", f"{width} x {height} pixels", accepted)
            views[camera.seen_as or name] = frames[name].seen_from(camera.pose(T_world_gripper))
        return Observation(views, T_world_gripper, state.gripper_opening, time_step, state.joint_positions)


def _known_driver(name: str, driver: str, known: tuple[str, ...]) -> None:
    if driver and driver not in known:
        raise InvalidInput(name, driver, f"{', '.join(known)}, or nothing if imop has no driver for it")


def _range(name: str, value: tuple[float, float]) -> tuple[float, float]:
    both = np.asarray(value, dtype=np.float64)
    if both.shape != (2,) or not np.all(np.isfinite(both)) or both[0] == both[1]:
        raise InvalidInput(name, f"{value}", "two positions of the joint, closed and open")
    return float(both[0]), float(both[1])
