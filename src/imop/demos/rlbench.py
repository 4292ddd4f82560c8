"""Reader of demonstrations in RLBench's on-disk layout (as PerAct, RVT and Act3D use it), without RLBench.

What is stored there in another convention is converted here, once: depth images become metres, cameras get
positive focal lengths, joint 4 gets Franka's zero.
"""

import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from imop.demos import unpickle
from imop.demos.images import read_depth, read_ids, read_rgb
from imop.demos.keyframes import published_keyframes
from imop.demos.store import DemonstrationStore
from imop.errors import CorruptData, InvalidInput
from imop.geometry.se3 import from_pose7
from imop.types import Action, CameraView, Demonstration, FloatArray, Keyframe, Observation, as_array

POLICY_CAMERAS = ("front", "left_shoulder", "right_shoulder", "wrist")
CAMERAS = (*POLICY_CAMERAS, "overhead")

# RLBench's model of the Panda has the zero of joint 4 turned by 4 degrees against Franka's.
JOINT_4_OFFSET = 0.0698
FINGER_STROKE = 0.04

LOW_DIM = "low_dim_obs.pkl"
_LAYOUT_FOLDER = re.compile(r"(episode\d+|episodes|all_variations|variation\d+)$")


def episodes(path: Path | str) -> list[Path]:
    """The episode folders in `path`: an episode, a task, one of its variations, or a folder of tasks.

    Returns:
        At least one folder, ordered by name with numbers in numeric order; each once, even if linked twice.

    Raises:
        InvalidInput: if there is none.
    """
    root = Path(path)
    if (root / LOW_DIM).is_file() or re.fullmatch(r"episode\d+", root.name):
        return [root]
    # The depths of an episode below: episodes/, all_variations/ or variationN/, a task, a folder of tasks.
    patterns = ("episode*", "episodes/episode*", "*/episodes/episode*", "*/*/episodes/episode*")
    found = {
        folder.resolve(): folder
        for pattern in patterns
        for folder in root.glob(pattern)
        if re.fullmatch(r"episode\d+", folder.name) and folder.is_dir()
    }
    if not found:
        raise InvalidInput(
            "path",
            f"{root} contains no episode of RLBench",
            f"a folder such as TASK/all_variations/episodes/episode0 with {LOW_DIM}, or one above it",
        )
    return sorted(found.values(), key=_natural)


def read_episode(path: Path | str, cameras: Sequence[str] = POLICY_CAMERAS) -> Demonstration:
    """Read one episode folder; of its images only frame 0 and the keyframes are needed.

    Collisions count as forbidden where the files do not say. Objects and seeds are unknown.

    Args:
        path: a folder with low_dim_obs.pkl and image folders such as front_rgb.
        cameras: names among `CAMERAS`.

    Raises:
        CorruptData: if something is missing, damaged or inconsistent; it names the file and the field.
        InvalidInput: if `cameras` is empty or names an unknown camera.
    """
    folder = Path(path)
    unknown = sorted(set(cameras) - set(CAMERAS))
    if unknown or not cameras:
        raise InvalidInput("cameras", f"{unknown or 'empty'}", ", ".join(CAMERAS))
    frames = _frames(folder / LOW_DIM)
    keyframes = _keyframes(folder / LOW_DIM, frames)
    _check_folders(folder, cameras, len(frames))
    variation, instructions = _variation(folder)
    try:
        seen = [_observation(folder, frames[i], i, step, cameras) for step, i in enumerate((0, *keyframes))]
        steps = [
            Keyframe(observation, _action(frames[i]))
            for observation, i in zip(seen[:-1], keyframes, strict=True)
        ]
    except InvalidInput as error:
        raise CorruptData(folder, str(error)) from error
    return Demonstration(tuple(steps), seen[-1], f"rlbench/{_task(folder)}", variation, instructions)


class _Frame:
    """The numbers of one frame; says which file and which field when one is missing."""

    def __init__(self, path: Path, index: int, fields: dict[str, Any]):
        self.path, self.index, self.fields = path, index, fields

    def __getitem__(self, name: str) -> Any:
        value = self.get(name)
        if value is None:
            raise CorruptData(self.path, f"frame {self.index} has no {name}", "record it with this field")
        return value

    def get(self, name: str) -> Any:
        misc = self.fields.get("misc")
        return self.fields.get(name, misc.get(name) if isinstance(misc, dict) else None)

    def numbers(self, name: str, shape: tuple[int | None, ...]) -> FloatArray:
        return as_array(name, self[name], shape)


def _frames(path: Path) -> list[_Frame]:
    record = unpickle.load(path)
    observations = record.fields.get("_observations") if isinstance(record, unpickle.DemoRecord) else record
    if not isinstance(observations, list) or not all(
        isinstance(o, unpickle.ObservationRecord) for o in observations
    ):
        raise CorruptData(path, "does not contain a demonstration of RLBench (a Demo of Observations)")
    return [_Frame(path, i, o.fields) for i, o in enumerate(observations)]


def _keyframes(path: Path, frames: list[_Frame]) -> list[int]:
    try:
        is_open = np.array([float(frame["gripper_open"]) for frame in frames])
        velocities = np.array([frame.numbers("joint_velocities", (None,)) for frame in frames])
        found = published_keyframes(is_open, velocities.reshape(len(frames), -1))
    except (InvalidInput, TypeError, ValueError) as error:
        raise CorruptData(path, f"gripper_open or joint_velocities: {error}") from error
    if not found:
        raise CorruptData(path, f"a recording of {len(frames)} frame(s) has no keyframe", "record it again")
    return found


def _check_folders(folder: Path, cameras: Sequence[str], n: int) -> None:
    for camera in cameras:
        for kind in ("rgb", "depth"):
            images = folder / f"{camera}_{kind}"
            if not images.is_dir():
                remedy = "restore it, or ask only for cameras that were recorded"
                raise CorruptData(images, f"the folder of camera {camera} is missing", remedy)
            surplus = [p.name for p in images.glob("*.png") if p.stem.isdigit() and int(p.stem) >= n]
            if surplus:
                problem = (
                    f"image {surplus[0]} is beyond the {n} frames of {LOW_DIM}: they do not belong together"
                )
                raise CorruptData(images, problem)


def _observation(folder: Path, frame: _Frame, i: int, step: int, cameras: Sequence[str]) -> Observation:
    fingers = frame.numbers("gripper_joint_positions", (None,))
    q = frame.numbers("joint_positions", (7,)).copy()
    q[3] += JOINT_4_OFFSET
    return Observation(
        views={camera: _view(folder, frame, i, camera) for camera in cameras},
        T_world_gripper=_gripper_pose(frame),
        gripper_opening=float(np.clip(fingers.mean() / FINGER_STROKE, 0.0, 1.0)),
        time_step=step,
        joint_positions=q,
        joint_velocities=frame.numbers("joint_velocities", (7,)),
    )


def _view(folder: Path, frame: _Frame, i: int, camera: str) -> CameraView:
    K = frame.numbers(f"{camera}_camera_intrinsics", (3, 3)).copy()
    T = _rigid(f"{camera}_camera_extrinsics", frame.numbers(f"{camera}_camera_extrinsics", (4, 4)))
    # Recorded camera frames have x to the image's left and y up, with negative focal lengths: half a turn
    # about the optical axis makes both positive and moves no point.
    if K[0, 0] < 0 and K[1, 1] < 0:
        K[[0, 1], [0, 1]] *= -1
        T = T @ np.diag([-1.0, -1.0, 1.0, 1.0])
    near, far = float(frame[f"{camera}_camera_near"]), float(frame[f"{camera}_camera_far"])
    rgb = read_rgb(folder / f"{camera}_rgb" / f"{i}.png")
    depth = read_depth(folder / f"{camera}_depth" / f"{i}.png", near, far)
    masks = folder / f"{camera}_mask"
    ids = read_ids(masks / f"{i}.png") if masks.is_dir() else None
    try:
        return CameraView(rgb, depth, K, T, ids)
    except InvalidInput as error:
        raise CorruptData(folder, f"camera {camera}, frame {i}: {error}") from error


def _action(frame: _Frame) -> Action:
    ignore_collisions = frame.get("ignore_collisions")
    return Action(
        T_world_gripper=_gripper_pose(frame),
        gripper_open=float(frame["gripper_open"]) > 0.5,
        allow_collisions=ignore_collisions is not None and bool(np.asarray(ignore_collisions).item()),
    )


def _gripper_pose(frame: _Frame) -> FloatArray:
    if frame.get("gripper_matrix") is None:  # recorded by an RLBench older than this field
        return from_pose7(frame.numbers("gripper_pose", (7,)))
    return _rigid("gripper_matrix", frame.numbers("gripper_matrix", (4, 4)))


def _rigid(name: str, T: FloatArray) -> FloatArray:
    """`T` with the nearest rotation; rounding is mended here, anything worse is for the caller to refuse."""
    error = np.abs(T[:3, :3] @ T[:3, :3].T - np.eye(3)).max()
    if not error < 1e-3 or error < 1e-12 or np.linalg.det(T[:3, :3]) < 0:
        return T
    mended = T.copy()
    mended[:3, :3] = Rotation.from_matrix(T[:3, :3]).as_matrix()
    return mended


def _variation(folder: Path) -> tuple[int, tuple[str, ...]]:
    """Number and descriptions; older files keep them one folder per variation instead of in the episode."""
    parent = next((p for p in folder.resolve().parents if re.fullmatch(r"variation\d+", p.name)), None)
    number_file = folder / "variation_number.pkl"
    if number_file.is_file() or parent is None:
        number = unpickle.load(number_file)
    else:
        number = int(parent.name.removeprefix("variation"))
    if not isinstance(number, int):
        raise CorruptData(number_file, f"contains a {type(number).__name__}, not the number of a variation")
    words_file = folder / "variation_descriptions.pkl"
    if not words_file.is_file() and parent is not None:
        words_file = parent / "variation_descriptions.pkl"
    words = unpickle.load(words_file)
    if not isinstance(words, list) or not all(isinstance(w, str) for w in words):
        raise CorruptData(words_file, "does not contain a list of descriptions")
    return number, tuple(words)


def _task(folder: Path) -> str:
    absolute = folder.resolve()
    return next(p.name for p in (absolute, *absolute.parents) if not _LAYOUT_FOLDER.match(p.name))


def _natural(path: Path) -> list[tuple[int, str]]:
    parts = re.split(r"(\d+)", path.as_posix())
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts]


def import_rlbench(
    source: Path | str,
    out: Path | str,
    cameras: Sequence[str] = POLICY_CAMERAS,
    track: Callable[[Sequence[Path]], Iterable[Path]] = iter,
) -> int:
    """Copy all episodes below `source` into the store `out`, which is made if it does not exist.

    Args:
        source: anything that `episodes` accepts.
        out: a new folder, or an existing store, which is appended to.
        cameras: as in `read_episode`.
        track: wraps the sequence of episode folders, to show progress.

    Returns:
        How many episodes were imported. If one cannot be read, those before it are in the store.

    Raises:
        InvalidInput: if `out` exists and is not a store, or there is no episode below `source`.
        CorruptData: as `read_episode`.
    """
    folders = episodes(source)
    exists = Path(out).is_dir() and any(Path(out).iterdir())
    store = DemonstrationStore.open(out) if exists else DemonstrationStore.create(out)
    for folder in track(folders):
        store.append(read_episode(folder, cameras))
    return len(folders)
