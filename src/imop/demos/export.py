"""Writer of RLBench's on-disk layout, for code that reads it (PerAct, RVT, Act3D): the reverse of `rlbench`.

An episode there is a film in which the published rule finds the keyframes by their rest. Ours has only the
keyframes, so each is preceded by a few copies of the one before it whose joint velocities say that the arm
moves.
"""

import shutil
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from imop.demos import rlbench_pickle
from imop.demos.keyframes import STOP_BUFFER, published_keyframes
from imop.demos.low_dim import FINGER_STROKE, JOINT_4_OFFSET, LOW_DIM, PANDA_JOINTS
from imop.demos.rlbench import CAMERAS
from imop.demos.store import DemonstrationStore
from imop.errors import InvalidInput
from imop.geometry import se3
from imop.types import ByteArray, CameraView, Demonstration, IntArray, Observation

NEAR = 0.01
FAR = {"front": 4.5, "left_shoulder": 3.2, "right_shoulder": 3.2, "wrist": 3.5, "overhead": 3.3}
"""Clipping planes of RLBench's cameras, metres; the far one is moved where something farther was measured."""
COPIES = STOP_BUFFER + 1
"""Moving frames before each keyframe: the rule accepts no rest in the four frames after another."""

_CODES = 2**24 - 1
_AT_REST = 0.1
_IMAGES = ("rgb", "depth", "mask", "point_cloud")


def export_rlbench(
    source: DemonstrationStore, out: Path, track: Callable[[range], Iterable[int]] = iter
) -> int:
    """Write all demonstrations of a store as TASK/all_variations/episodes/episodeN below `out`.

    Object poses, names of instances and the seed of the objects have no place in that layout. An action's
    pose is there the pose that the gripper has afterwards. Joint 4 of an arm with seven joints is shifted
    as RLBench's Panda is; the importer shifts it back.

    Args:
        source: the store.
        out: a folder that does not exist or is empty.
        track: wraps the episode numbers, to show progress.

    Returns:
        How many episodes were written.

    Raises:
        InvalidInput: if `out` is not empty, or a demonstration cannot be expressed in the layout.
        CorruptData: if the store cannot be read.
    """
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise InvalidInput("out", f"{out} already exists", "a new or empty folder")
    counts: dict[str, int] = {}
    for index in track(range(len(source))):
        demonstration = source[index]
        task = demonstration.task.split("/")[-1] or "task"
        number = counts.get(task, 0)
        counts[task] = number + 1
        write_episode(demonstration, out / task / "all_variations" / "episodes" / f"episode{number}")
    return len(source)


def write_episode(demonstration: Demonstration, folder: Path) -> None:
    """Write one episode folder; it appears whole or not at all.

    Raises:
        InvalidInput: if the folder exists, or something is missing or out of range that the layout needs.
    """
    if folder.exists():
        raise InvalidInput("folder", f"{folder} already exists", "a new folder")
    unfinished = folder.with_name(f".{folder.name}.tmp")
    shutil.rmtree(unfinished, ignore_errors=True)
    unfinished.mkdir(parents=True)
    try:
        _write(demonstration, unfinished)
        unfinished.rename(folder)
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)


def _write(demonstration: Demonstration, folder: Path) -> None:
    seen = [*(k.observation for k in demonstration.keyframes), demonstration.final]
    records: list[rlbench_pickle.Observation] = []
    for step, observation in enumerate(seen):
        copies = COPIES if step + 1 < len(seen) else 0
        _write_views(folder, observation, len(records), copies)
        records += [_record(demonstration, observation, step, moving=i > 0) for i in range(copies + 1)]
    _check(records)
    seed = demonstration.seeds.get("episode", 0) % 2**32
    demo = rlbench_pickle.Demo(
        _observations=records,
        random_seed=np.random.RandomState(seed).get_state(),
        variation_number=int(demonstration.variation),
    )
    (folder / LOW_DIM).write_bytes(rlbench_pickle.dumps(demo))
    number, words = int(demonstration.variation), list(demonstration.instructions)
    (folder / "variation_number.pkl").write_bytes(rlbench_pickle.dumps(number))
    (folder / "variation_descriptions.pkl").write_bytes(rlbench_pickle.dumps(words))


def _check(records: list[rlbench_pickle.Observation]) -> None:
    """The published rule must find what was meant."""
    fields = [vars(record) for record in records]
    found = published_keyframes(
        np.array([f["gripper_open"] for f in fields]), np.array([f["joint_velocities"] for f in fields])
    )
    wanted = list(range(COPIES + 1, len(records), COPIES + 1))
    if found != wanted:
        raise InvalidInput(
            "keyframes", f"would be found at {found} instead of {wanted}", "joint velocities that say so"
        )


def _record(
    demonstration: Demonstration, observation: Observation, step: int, moving: bool
) -> rlbench_pickle.Observation:
    q, dq = observation.joint_positions, observation.joint_velocities
    if q is None:
        raise InvalidInput("joint_positions", "missing", "those of the arm, radians")
    at_rest = dq if dq is not None and np.abs(dq).max() <= _AT_REST else np.zeros(len(q))
    q_recorded = q.copy()
    if len(q) == PANDA_JOINTS:
        q_recorded[3] -= JOINT_4_OFFSET
    before = demonstration.keyframes[step - 1].action if step else None
    is_open = before.gripper_open if before else observation.gripper_opening > 0.5
    misc: dict[str, Any] = {}
    for camera, view in observation.views.items():
        misc |= _camera(camera, view)
    nothing = {f"{camera}_{kind}": None for camera in CAMERAS for kind in _IMAGES}
    return rlbench_pickle.Observation(
        **nothing,
        joint_velocities=np.ones(len(q)) if moving else np.array(at_rest),
        joint_positions=q_recorded,
        joint_forces=np.zeros(len(q)),
        gripper_open=1.0 if is_open else 0.0,
        gripper_pose=se3.to_pose7(observation.T_world_gripper),
        gripper_matrix=np.array(observation.T_world_gripper),
        gripper_joint_positions=np.full(2, FINGER_STROKE * observation.gripper_opening),
        gripper_touch_forces=np.zeros(6),
        task_low_dim_state=np.zeros(0),
        ignore_collisions=np.array(1.0 if before and before.allow_collisions else 0.0),
        misc=misc,
    )


def _camera(camera: str, view: CameraView) -> dict[str, Any]:
    # Recorded camera frames have x to the image's left and y up, with negative focal lengths.
    K = view.intrinsics.copy()
    K[[0, 1], [0, 1]] *= -1
    return {
        f"{camera}_camera_extrinsics": view.T_world_camera @ np.diag([-1.0, -1.0, 1.0, 1.0]),
        f"{camera}_camera_intrinsics": K,
        f"{camera}_camera_near": NEAR,
        f"{camera}_camera_far": _far(camera, view),
    }


def _far(camera: str, view: CameraView) -> float:
    if camera not in CAMERAS:
        raise InvalidInput("views", f"there is a camera {camera}", ", ".join(CAMERAS))
    farthest = float(view.depth[view.measured].max(initial=0.0))
    return FAR[camera] if farthest <= FAR[camera] else float(np.ceil(farthest))


def _write_views(folder: Path, observation: Observation, first: int, copies: int) -> None:
    """Images of frame number `first`, and the same for the `copies` frames after it."""
    for camera, view in observation.views.items():
        images = {"rgb": view.rgb, "depth": _depth_code(view, NEAR, _far(camera, view))}
        if view.instance_ids is not None:
            images["mask"] = _bytes(view.instance_ids, "RGB")
        for kind, pixels in images.items():
            into = folder / f"{camera}_{kind}"
            into.mkdir(exist_ok=True)
            Image.fromarray(pixels).save(into / f"{first}.png")
            for other in range(first + 1, first + copies + 1):
                shutil.copyfile(into / f"{first}.png", into / f"{other}.png")


def _depth_code(view: CameraView, near: float, far: float) -> ByteArray:
    """(H, W, 3) bytes of the fraction between the planes, highest first; all ones where nothing was seen."""
    seen = view.measured
    depth = np.where(seen, view.depth, far).astype(np.float64)
    if depth.min() < near:
        raise InvalidInput("depth", f"{depth.min():.4f} m", f"at least {near} m, RLBench's near plane")
    code = np.rint((depth - near) / (far - near) * _CODES)
    return _bytes(np.where(seen, np.minimum(code, _CODES - 1), _CODES).astype(np.int32), "BGR")


def _bytes(numbers: IntArray, order: str) -> ByteArray:
    """(H, W, 3) uint8: the lowest byte in red for order RGB, in blue for BGR."""
    if numbers.min(initial=0) < 0 or numbers.max(initial=0) > _CODES:
        raise InvalidInput("instance_ids", f"{numbers.min()} .. {numbers.max()}", f"0 .. {_CODES}")
    pixels = np.stack([numbers >> shift & 255 for shift in (0, 8, 16)], axis=-1).astype(np.uint8)
    return pixels if order == "RGB" else np.ascontiguousarray(pixels[..., ::-1])
