"""Checks an episode in RLBench's layout: the files themselves, then the demonstration in them."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from imop.demos.check_steps import TipPose, check_demonstration
from imop.demos.findings import Finding
from imop.demos.low_dim import LOW_DIM, Frame, read_frames
from imop.demos.rlbench import (
    find_keyframes,
    joint_velocities,
    path_keyframes,
    read_episode,
    recorded_cameras,
)
from imop.errors import ImopError
from imop.geometry import se3
from imop.types import Demonstration

NEAR_FRAMES = 5


def check_episode(
    folder: Path,
    cameras: Sequence[str],
    tip_pose: TipPose | None = None,
    demonstration: Demonstration | None = None,
) -> Iterator[Finding]:
    """Everything that looks wrong in one episode folder; the last finding may be what makes it unreadable.

    Args:
        folder: of the episode.
        cameras: which it should have.
        tip_pose: as in `check`.
        demonstration: what `read_episode` gave for these cameras; read from the folder if None.
    """
    present = [c for c in cameras if all((folder / f"{c}_{kind}").is_dir() for kind in ("rgb", "depth"))]
    for camera in cameras:
        if camera not in present:
            problem = f"the rgb or the depth images of camera {camera} are missing"
            recorded = ", ".join(recorded_cameras(folder)) or "there is none"
            remedy = f"restore them, or ask for cameras that were recorded: {recorded}"
            yield Finding("error", f"{folder}, camera {camera}", problem, remedy)
    try:
        frames = read_frames(folder / LOW_DIM)
        yield from _poses(frames, str(folder / LOW_DIM))
        yield from _rests(frames, str(folder / LOW_DIM))
        if present:
            read = read_episode(folder, present) if demonstration is None else demonstration
            yield from check_demonstration(read, str(folder), tip_pose)
    except ImopError as error:
        yield Finding.of(error, str(folder))


def _poses(frames: list[Frame], where: str) -> Iterator[Finding]:
    """gripper_pose and gripper_matrix say the same twice, so a wrong one shows."""
    if not all(frame.has("gripper_matrix") and frame.has("gripper_pose") for frame in frames):
        return
    here = f"{where}, gripper_pose"
    pose7 = np.array([frame.numbers("gripper_pose", (7,)) for frame in frames])
    matrices = np.array([frame.rigid("gripper_matrix") for frame in frames])
    length = np.linalg.norm(pose7[:, 3:], axis=1)
    if np.abs(length - 1).max() > 1e-2:
        problem = f"a quaternion has length {length[np.abs(length - 1).argmax()]:.3g}"
        yield Finding("error", here, problem, "give x y z and a unit quaternion x y z w")
        return
    poses = se3.from_pose7(pose7)
    if se3.translation_distance(poses, matrices).max() > 1e-3:
        problem = "the position differs from gripper_matrix"
        yield Finding("error", here, problem, "give both in metres, of the same moment")
    if se3.rotation_distance(poses, matrices).max() > 1e-2:
        problem, remedy = "the rotation differs from gripper_matrix", "record both at the same moment"
        wxyz = se3.from_pose7(pose7[:, [0, 1, 2, 4, 5, 6, 3]])
        if se3.rotation_distance(wxyz, matrices).max() < 1e-2:
            problem, remedy = "the quaternion is in the order w x y z", "reorder it to x y z w"
        yield Finding("error", here, problem, remedy)


def _rests(frames: list[Frame], where: str) -> Iterator[Finding]:
    """Keyframes by the gripper's path that joint velocities do not show."""
    here = f"{where}, joint_velocities"
    if joint_velocities(frames) is None:
        problem = "they are missing or 0 in all frames; keyframes are taken where the gripper rests or opens"
        yield Finding("warning", here, problem, "record them, in rad/s")
        return
    found = find_keyframes(frames)
    for i in path_keyframes(frames):
        near = [j for j in found if abs(i - j) <= NEAR_FRAMES]
        if not near:
            problem = f"the gripper rests at frame {i}, but no keyframe is near: they are {found}"
            remedy = "check that joint_velocities are in rad/s; else a keyframe is missing"
            yield Finding("warning", here, problem, remedy)
