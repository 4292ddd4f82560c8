"""An episode that an importer found: the arm's motion, and images that are read when they are asked for."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.importing.side import PoseFormat, Side
from imop.recording.folder import RecordedCamera
from imop.recording.motion import Motion
from imop.types import ByteArray, Float32Array, FloatArray, Observation, as_finite

Images = tuple[ByteArray, Float32Array]
"""Colour (H, W, 3) and depth (H, W) in the units that the camera's depth scale is for."""


@dataclass(frozen=True, eq=False)
class Episode:
    """A `Source`.

    Attributes:
        name: what messages call it.
        motion: what the arm did.
        cameras: what is known of each, complete.
        look: (camera, frame) -> its images.
        task: for bookkeeping.
        instructions: the task in words.
    """

    name: str
    motion: Motion
    cameras: Mapping[str, RecordedCamera]
    look: Callable[[str, int], Images]
    task: str = ""
    instructions: tuple[str, ...] = field(default=())

    def observation(self, frame: int, time_step: int = 0) -> Observation:
        """As `Source.observation`."""
        T = self.motion.T_world_gripper[frame]
        views = {name: camera.view(name, *self.look(name, frame), T) for name, camera in self.cameras.items()}
        q = self.motion.joint_positions
        opening = float(self.motion.gripper_opening[frame])
        return Observation(views, T, opening, time_step, None if q is None else q[frame])


def complete_cameras(side: Side, recorded: Mapping[str, RecordedCamera]) -> dict[str, RecordedCamera]:
    """What is known of each camera of a recording.

    Raises:
        InvalidInput: for the first field that nothing says.
    """
    cameras = {name: side.camera(name, camera) for name, camera in recorded.items()}
    for name, camera in cameras.items():
        camera.require(name)
    return cameras


def opening_of(fingers: Mapping[str, FloatArray], ranges: Mapping[str, tuple[float, float]]) -> FloatArray:
    """(n,) opening, 0 closed .. 1 open, of finger positions (n,); the mean, if there are several.

    Raises:
        InvalidInput: if they are far outside of their ranges, as other units are.
    """
    shares = []
    for name, values in fingers.items():
        closed, opened = ranges[name]
        share = (values - closed) / (opened - closed)
        if share.min() < -0.2 or share.max() > 1.2:
            problem = f"it is {values.min():.4g} .. {values.max():.4g}, not {closed:g} .. {opened:g}"
            raise InvalidInput(f"gripper.fingers.{name}", problem, "its values when closed, and when open")
        shares.append(np.clip(share, 0.0, 1.0))
    return np.asarray(np.mean(shares, axis=0))


def poses_of(numbers: FloatArray, how: PoseFormat, T_frame_gripper: FloatArray) -> FloatArray:
    """(n, 4, 4) poses of the gripper of numbers (n, 7), (n, 6) or (n, 16).

    Raises:
        InvalidInput: if there are not so many, or they are no rigid motions.
    """
    count = {"xyzw": 7, "wxyz": 7, "rotation_vector": 6, "matrix": 16}[how]
    rows = as_finite("gripper.pose", numbers.reshape(len(numbers), -1), (None, None))
    if rows.shape[1] != count:
        accepted = f"{count}, as pose_format = {how!r} has; or another pose_format"
        raise InvalidInput("gripper.pose", f"{rows.shape[1]} numbers", accepted)
    if how == "matrix":
        return np.asarray([se3.orthonormal(T) for T in rows.reshape(-1, 4, 4)] @ T_frame_gripper)
    if how == "rotation_vector":
        T = np.array([se3.make(Rotation.from_rotvec(row[3:]).as_matrix(), row[:3]) for row in rows])
        return np.asarray(T @ T_frame_gripper)
    order = [0, 1, 2, 3, 4, 5, 6] if how == "xyzw" else [0, 1, 2, 4, 5, 6, 3]
    return np.asarray(np.array([se3.from_pose7(row[order]) for row in rows]) @ T_frame_gripper)


def kinematic_poses(side: Side, joint_positions: FloatArray, lacking: str, accepted: str) -> FloatArray:
    """(n, 4, 4) poses of the gripper by the arm of the set-up.

    Args:
        side: with the set-up.
        joint_positions: (n, J) radians.
        lacking: the field that would say the poses.
        accepted: what it could be.

    Raises:
        InvalidInput: without a set-up, or if the arm has another number of joints.
    """
    if side.setup is None:
        raise InvalidInput(lacking, "missing", f"{accepted}; or a set-up, by whose arm joints tell it")
    from imop.setup.arm import arm_of

    expected = len(side.setup.robot.home)
    if joint_positions.shape[1] != expected:
        problem = f"{joint_positions.shape[1]} of them"
        raise InvalidInput("joints", problem, f"the {expected} of the arm of the set-up, in its order")
    arm = arm_of(side.setup)
    return np.array([arm.tip_pose(q) for q in joint_positions])
