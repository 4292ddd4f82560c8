"""Reader of demonstrations in RLBench's on-disk layout (as PerAct, RVT and Act3D use it), without RLBench.

What is stored there in another convention is converted here, once: depth images become metres, cameras get
positive focal lengths, joint 4 gets Franka's zero.
"""

import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np

from imop.demos import unpickle
from imop.demos.images import read_depth, read_ids, read_rgb
from imop.demos.keyframes import published_keyframes
from imop.demos.low_dim import LOW_DIM, Frame, read_frames
from imop.demos.store import DemonstrationStore
from imop.errors import CorruptData, InvalidInput
from imop.types import Action, CameraView, Demonstration, Keyframe, Observation

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
    frames = read_frames(folder / LOW_DIM)
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


def _keyframes(path: Path, frames: list[Frame]) -> list[int]:
    is_open = np.array([frame.gripper_open for frame in frames])
    velocities = np.array([frame.numbers("joint_velocities", (7,)) for frame in frames]).reshape(-1, 7)
    found = published_keyframes(is_open, velocities)
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


def _observation(folder: Path, frame: Frame, i: int, step: int, cameras: Sequence[str]) -> Observation:
    return Observation(
        views={camera: _view(folder, frame, i, camera) for camera in cameras},
        T_world_gripper=frame.T_world_gripper,
        gripper_opening=frame.gripper_opening,
        time_step=step,
        joint_positions=frame.joint_positions,
        joint_velocities=frame.numbers("joint_velocities", (7,)),
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
