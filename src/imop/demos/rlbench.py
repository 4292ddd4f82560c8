"""Reader of demonstrations in RLBench's on-disk layout (as PerAct, RVT and Act3D use it), without RLBench.

What is stored there in another convention is converted here, once: depth images become metres, cameras get
positive focal lengths, joint 4 gets Franka's zero.
"""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from imop.demos import unpickle
from imop.demos.images import read_depth, read_ids, read_rgb
from imop.demos.keyframes import pose_keyframes, published_keyframes
from imop.demos.low_dim import LOW_DIM, TIME_STEP, Frame, read_frames
from imop.errors import CorruptData, InvalidInput
from imop.types import Action, CameraView, Demonstration, FloatArray, Keyframe, Observation

POLICY_CAMERAS = ("front", "left_shoulder", "right_shoulder", "wrist")
CAMERAS = (*POLICY_CAMERAS, "overhead")

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


def read_episode(path: Path | str, cameras: Sequence[str] | None = None) -> Demonstration:
    """Read one episode folder; of its images only frame 0 and the keyframes are needed.

    Collisions count as forbidden where the files do not say. Objects and seeds are unknown.

    Args:
        path: a folder with low_dim_obs.pkl and image folders such as front_rgb.
        cameras: names among `CAMERAS`; by default those of `POLICY_CAMERAS` that were recorded.

    Raises:
        CorruptData: if something is missing, damaged or inconsistent; it names the file and the field.
        InvalidInput: if `cameras` is empty or names an unknown camera.
    """
    folder = Path(path)
    frames = read_frames(folder / LOW_DIM)
    keyframes = find_keyframes(frames)
    if not keyframes:
        problem = f"a recording of {len(frames)} frame(s) has no keyframe"
        raise CorruptData(folder / LOW_DIM, problem, "record it again")
    chosen = _cameras(folder, cameras)
    _check_folders(folder, chosen, len(frames))
    variation, instructions = _variation(folder)
    try:
        seen = [_observation(folder, frames[i], i, step, chosen) for step, i in enumerate((0, *keyframes))]
        steps = [
            Keyframe(observation, _action(frames[i]))
            for observation, i in zip(seen[:-1], keyframes, strict=True)
        ]
    except InvalidInput as error:
        raise CorruptData(folder, str(error)) from error
    return Demonstration(tuple(steps), seen[-1], f"rlbench/{_task(folder)}", variation, instructions)


def recorded_cameras(folder: Path) -> list[str]:
    """Which of `CAMERAS` an episode has images of, colour or depth."""
    return [c for c in CAMERAS if any((folder / f"{c}_{kind}").is_dir() for kind in ("rgb", "depth"))]


def find_keyframes(frames: Sequence[Frame]) -> list[int]:
    """Numbers of the keyframes: by the published rule, or by the gripper's path if velocities are unknown.

    Raises:
        CorruptData: if a frame lacks what the rule needs, or the state of the gripper is given in metres.
    """
    states = np.array([frame.number("gripper_open") for frame in frames])
    if 0 < states.max() <= 0.1:
        problem = f"gripper_open is at most {states.max():.3g}, as a width in metres is"
        raise CorruptData(frames[0].path, problem, "give the state of the gripper, 0 closed or 1 open")
    velocities = joint_velocities(frames)
    if velocities is None:
        return path_keyframes(frames)
    return published_keyframes(np.array([frame.gripper_open for frame in frames]), velocities)


def joint_velocities(frames: Sequence[Frame]) -> FloatArray | None:
    """(n, 7) radians per second; None if they are missing or 0 throughout, so that nobody measured them."""
    if not any(frame.has("joint_velocities") for frame in frames):
        return None
    velocities = np.array([frame.numbers("joint_velocities", (7,)) for frame in frames])
    return velocities if velocities.any() else None


def path_keyframes(frames: Sequence[Frame]) -> list[int]:
    """Numbers of the keyframes by where the gripper was, whatever the joint velocities say."""
    T = np.array([frame.T_world_gripper for frame in frames])
    opening = np.array([frame.gripper_opening for frame in frames])
    return pose_keyframes(T, opening, np.arange(len(frames), dtype=np.float64) * TIME_STEP)


def check_names(cameras: Sequence[str]) -> None:
    """Refuses names of cameras that RLBench does not have.

    Raises:
        InvalidInput: if there is one, or no name at all.
    """
    unknown = sorted(set(cameras) - set(CAMERAS))
    if unknown or not cameras:
        raise InvalidInput("cameras", f"{unknown or 'empty'}", ", ".join(CAMERAS))


def _cameras(folder: Path, asked: Sequence[str] | None) -> Sequence[str]:
    recorded = recorded_cameras(folder)
    if asked is None:
        chosen = [camera for camera in POLICY_CAMERAS if camera in recorded]
        missing = [] if chosen else list(POLICY_CAMERAS)
    else:
        check_names(asked)
        chosen = list(asked)
        missing = [camera for camera in asked if camera not in recorded]
    if missing:
        problem = f"there are no images of camera {', '.join(missing)}"
        remedy = f"ask for cameras that were recorded: {', '.join(recorded) or 'there is none'}"
        raise CorruptData(folder, problem, remedy)
    return chosen


def _check_folders(folder: Path, cameras: Sequence[str], n: int) -> None:
    for camera in cameras:
        for kind in ("rgb", "depth"):
            images = folder / f"{camera}_{kind}"
            if not images.is_dir():
                remedy = "restore it, or do not ask for this camera"
                raise CorruptData(images, f"the folder of camera {camera} is missing", remedy)
            surplus = [p.name for p in images.glob("*.png") if p.stem.isdecimal() and int(p.stem) >= n]
            if surplus:
                problem = (
                    f"image {surplus[0]} is beyond the {n} frames of {LOW_DIM}: they do not belong together"
                )
                raise CorruptData(images, problem)


def _observation(folder: Path, frame: Frame, i: int, step: int, cameras: Sequence[str]) -> Observation:
    return Observation(
        views={camera: _view(folder, frame, i, camera) for camera in cameras},
        T_world_gripper=frame.T_world_gripper,
        gripper_opening=frame.gripper_opening,
        time_step=step,
        joint_positions=frame.joint_positions,
        joint_velocities=frame.numbers("joint_velocities", (7,)) if frame.has("joint_velocities") else None,
    )


def _view(folder: Path, frame: Frame, i: int, camera: str) -> CameraView:
    K = frame.numbers(f"{camera}_camera_intrinsics", (3, 3)).copy()
    T = frame.rigid(f"{camera}_camera_extrinsics")
    # Recorded camera frames have x to the image's left and y up, with negative focal lengths: half a turn
    # about the optical axis makes both positive and moves no point.
    if K[0, 0] < 0 and K[1, 1] < 0:
        K[[0, 1], [0, 1]] *= -1
        T = T @ np.diag([-1.0, -1.0, 1.0, 1.0])
    near, far = (frame.number(f"{camera}_camera_{plane}") for plane in ("near", "far"))
    if not 0 < near < far:
        problem = f"frame {i}: the clipping planes of camera {camera} are {near} and {far} m"
        raise CorruptData(frame.path, problem, "record 0 < near < far, in metres")
    rgb = read_rgb(folder / f"{camera}_rgb" / f"{i}.png")
    depth = read_depth(folder / f"{camera}_depth" / f"{i}.png", near, far)
    masks = folder / f"{camera}_mask"
    ids = read_ids(masks / f"{i}.png") if masks.is_dir() else None
    try:
        return CameraView(rgb, depth, K, T, ids)
    except InvalidInput as error:
        raise CorruptData(folder, f"camera {camera}, frame {i}: {error}") from error


def _action(frame: Frame) -> Action:
    return Action(
        T_world_gripper=frame.T_world_gripper,
        gripper_open=frame.gripper_open,
        allow_collisions=frame.has("ignore_collisions") and frame.number("ignore_collisions") > 0.5,
    )


def _variation(folder: Path) -> tuple[int, tuple[str, ...]]:
    """Number and descriptions; older files keep them one folder per variation instead of in the episode."""
    parent = next((p for p in folder.resolve().parents if re.fullmatch(r"variation\d+", p.name)), None)
    number_file = folder / "variation_number.pkl"
    if number_file.is_file() or parent is None:
        number = unpickle.load(number_file)
    else:
        number = int(parent.name.removeprefix("variation"))
    if not isinstance(number, int | np.integer):
        raise CorruptData(number_file, f"contains a {type(number).__name__}, not the number of a variation")
    words_file = folder / "variation_descriptions.pkl"
    if not words_file.is_file() and parent is not None:
        words_file = parent / "variation_descriptions.pkl"
    words = unpickle.load(words_file)
    if not isinstance(words, list) or not all(isinstance(w, str) for w in words):
        raise CorruptData(words_file, "does not contain a list of descriptions")
    return int(number), tuple(str(word) for word in words)


def _task(folder: Path) -> str:
    absolute = folder.resolve()
    return next(p.name for p in (absolute, *absolute.parents) if not _LAYOUT_FOLDER.match(p.name))


def _natural(path: Path) -> list[tuple[int, str]]:
    parts = re.split(r"(\d+)", path.as_posix())
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts]
