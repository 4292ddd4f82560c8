"""LeRobot's datasets of version 3, with depth. They lack intrinsics and poses of cameras.

Rows are in data/, one Parquet file for many episodes; images are in the rows, or in videos/, many episodes in
one file. Depth that is a video is 12 bits of a logarithm, whose parameters are in meta/info.json.
"""

import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from imop.errors import CorruptData, InvalidInput
from imop.extras import extra
from imop.files import read
from imop.importing.episode import (
    Episode,
    Images,
    complete_cameras,
    kinematic_poses,
    opening_of,
    poses_of,
)
from imop.importing.side import Side
from imop.importing.videos import video_frame
from imop.recording.folder import RecordedCamera
from imop.recording.motion import Motion
from imop.types import ByteArray, Float32Array, FloatArray

INFO = "meta/info.json"
STATE = "observation.state"
_UNITS = {"mm": 0.001, "m": 1.0}
_QUANTA = 4095
_REMEDY = "restore it, or download the dataset again"


@dataclass(frozen=True, eq=False)
class Dataset:
    """A dataset on disk.

    Attributes:
        root: its folder.
        info: content of meta/info.json.
        side: what it lacks.
    """

    root: Path
    info: Mapping[str, Any]
    side: Side

    @property
    def features(self) -> Mapping[str, Any]:
        """Of the rows, by name."""
        return dict(self.info["features"])

    @cached_property
    def rows(self) -> list[dict[str, Any]]:
        """What is known of each episode, in order of their numbers."""
        files = sorted((self.root / "meta" / "episodes").rglob("*.parquet"))
        if not files:
            raise CorruptData(self.root / "meta" / "episodes", "holds no list of the episodes", _REMEDY)
        found = [
            {name: value for name, value in row.items() if not name.startswith("stats/")}
            for file in files
            for row in _table(file).to_pylist()
        ]
        return sorted(found, key=lambda row: int(row["episode_index"]))

    @cached_property
    def cameras(self) -> dict[str, tuple[str, str]]:
        """Camera -> features of its colours and its depth.

        Raises:
            InvalidInput: if nothing says which depth belongs to which colours.
        """
        images = [name for name, f in self.features.items() if f["dtype"] in ("image", "video")]
        depths = [name for name in images if self._is_depth(name)]
        colors = [name for name in images if name not in depths]
        if self.side.chooses:
            chosen = {name: (camera.rgb, camera.depth) for name, camera in self.side.cameras.items()}
            for name, pair in chosen.items():
                for kind, feature, there in zip(("rgb", "depth"), pair, (colors, images), strict=True):
                    if feature not in there:
                        problem = f"{feature!r} is no such feature" if feature else "missing"
                        raise InvalidInput(
                            f"cameras.{name}.{kind}", problem, ", ".join(there) or "there is none"
                        )
            return chosen
        found = {
            color.removeprefix("observation.images."): (color, depth)
            for color in colors
            for depth in depths
            if depth in (f"{color}_depth", f"{color}.depth", color.replace("rgb", "depth"))
        }
        if not found:
            if not depths:
                accepted = f"a depth feature of each camera among {', '.join(images) or 'its features'}"
                raise InvalidInput("cameras.NAME.depth", "the dataset marks no feature as depth", accepted)
            accepted = f"[cameras.NAME] with rgb and depth, of {', '.join(images)}"
            raise InvalidInput("cameras", "no colours are called as a depth is, without _depth", accepted)
        self.side.require_names(found)
        return found

    def _is_depth(self, name: str) -> bool:
        info = self.features[name].get("info") or self.features[name].get("video_info") or {}
        return bool(info.get("is_depth_map") or info.get("video.is_depth_map"))

    def depth_scale(self, feature: str) -> float | None:
        """Metres per unit of what `_depth` gives, if the dataset says it."""
        info = self.features[feature].get("info") or {}
        if self.features[feature]["dtype"] == "video":
            return 1.0 if "video.depth_max" in info else None
        return _UNITS.get(str(info.get("depth_unit")))

    def data(self, row: Mapping[str, Any]) -> Any:
        """The rows of an episode."""
        path = self.info["data_path"].format(
            chunk_index=row["data/chunk_index"], file_index=row["data/file_index"]
        )
        table = _table(self.root / path)
        chosen = np.asarray(table.column("episode_index")).ravel() == row["episode_index"]
        return table.filter(_mask(chosen))

    def images(self, row: Mapping[str, Any], table: Any, camera: str, frame: int) -> Images:
        """What a camera saw in a frame of an episode."""
        color, depth = self.cameras[camera]
        return self._color(row, table, color, frame), self._depth(row, table, depth, frame)

    def _color(self, row: Mapping[str, Any], table: Any, feature: str, frame: int) -> ByteArray:
        if self.features[feature]["dtype"] == "video":
            return np.asarray(self._video(row, feature, frame, "rgb24"), np.uint8)
        image = np.asarray(_image(table, feature, frame).convert("RGB"))
        return np.asarray(image, np.uint8)

    def _depth(self, row: Mapping[str, Any], table: Any, feature: str, frame: int) -> Float32Array:
        if self.features[feature]["dtype"] == "video":
            codes = self._video(row, feature, frame, "gray12le")
            return dequantized(codes, self.features[feature].get("info") or {})
        return np.asarray(_image(table, feature, frame), np.float32)

    def _video(self, row: Mapping[str, Any], feature: str, frame: int, pixels: str) -> Any:
        names = {name: row[f"videos/{feature}/{name}"] for name in ("chunk_index", "file_index")}
        path = self.root / self.info["video_path"].format(video_key=feature, **names)
        begin = float(row[f"videos/{feature}/from_timestamp"])
        return video_frame(path, begin + frame / float(self.info["fps"]), pixels)


def dequantized(codes: Any, info: Mapping[str, Any]) -> Float32Array:
    """(H, W) metres of codes of 12 bits (LeRobot's `dequantize_depth`); the codes as they are without range.

    Code 0 is no measurement: LeRobot puts there what is 0, or nearer than the range.
    """
    code = np.asarray(codes, np.float32)
    if "video.depth_max" not in info:
        return code
    low, high = float(info["video.depth_min"]), float(info["video.depth_max"])
    share, shift = code / _QUANTA, float(info.get("video.shift", 0.0))
    if info.get("video.use_log"):
        begin, end = np.log(low + shift), np.log(high + shift)
        depth = np.exp(begin + share * (end - begin)) - shift
    else:
        depth = low + share * (high - low)
    return np.where(code == 0, 0.0, depth).astype(np.float32)


def read_dataset(root: Path, side: Side) -> list[Episode]:
    """The episodes of a dataset; images are read when they are asked for.

    Raises:
        CorruptData: if a file is missing or damaged, or the dataset is of another version.
        InvalidInput: for the first thing that neither the dataset nor the side file nor the set-up says.
        MissingExtra: without pyarrow or PyAV.
    """
    path = root / INFO
    try:
        info = json.loads(read(path, "give the folder of a LeRobot dataset, the one with meta/ in it"))
        version = str(info["codebase_version"])
    except (ValueError, KeyError, TypeError) as error:
        raise CorruptData(path, f"is no description of a dataset ({error!r})", _REMEDY) from error
    if not version.startswith("v3."):
        remedy = "convert it: python -m lerobot.scripts.convert_dataset_v21_to_v30"
        raise CorruptData(path, f"is of version {version}, but v3 is read", remedy)
    dataset = Dataset(root, info, side)
    recorded = {
        name: RecordedCamera(depth_scale=dataset.depth_scale(depth))
        for name, (_, depth) in dataset.cameras.items()
    }
    cameras = complete_cameras(side, recorded)
    return [_episode(dataset, row, cameras) for row in dataset.rows]


def _episode(dataset: Dataset, row: Mapping[str, Any], cameras: Mapping[str, RecordedCamera]) -> Episode:
    table = dataset.data(row)
    if table.num_rows != int(row["length"]):
        problem = f"episode {row['episode_index']} has {table.num_rows} rows, not {row['length']}"
        raise CorruptData(dataset.root / "data", problem, _REMEDY)
    words = tuple(str(word) for word in row.get("tasks") or ())
    number = int(row["episode_index"])
    return Episode(
        f"{dataset.root}, episode {number}",
        _motion(dataset, table),
        cameras,
        lambda camera, frame: dataset.images(row, table, camera, frame),
        f"lerobot/{dataset.root.resolve().name}",
        words,
    )


def _motion(dataset: Dataset, table: Any) -> Motion:
    side, columns = dataset.side, _numbers(dataset, table)
    known = ", ".join(columns)
    for number, name in enumerate(side.joints):
        if name not in columns:
            raise InvalidInput(f"joints[{number}]", f"{name!r} is not there", known)
    for name in side.fingers:
        if name not in columns:
            raise InvalidInput(f"gripper.fingers.{name}", "is not there", known)
    if not side.fingers:
        accepted = f"{{NAME = [closed, open]}}, its values when closed and when open; NAME is one of {known}"
        raise InvalidInput("gripper.fingers", "missing", accepted)
    if not side.joints:
        accepted = f"names of the arm's joints, in order, of {known}"
        raise InvalidInput("joints", "missing", accepted)
    q = np.stack([columns[name] for name in side.joints], axis=1)
    q = np.radians(q) if side.degrees else q
    if side.pose:
        if side.pose not in table.column_names:
            raise InvalidInput("gripper.pose", f"no feature {side.pose!r}", ", ".join(table.column_names))
        poses = poses_of(_array(table, side.pose), side.pose_format, side.T_frame_gripper)
    else:
        accepted = f"a feature with the gripper's pose in the world, of {', '.join(table.column_names)}"
        poses = kinematic_poses(side, q, "gripper.pose", accepted)
    opening = opening_of({name: columns[name] for name in side.fingers}, side.fingers)
    # Stamps are 32 bit floats of frame / fps, so the frame's number says the time better.
    times = np.arange(table.num_rows) / float(dataset.info["fps"])
    return Motion(times, poses, opening, q)


def _numbers(dataset: Dataset, table: Any) -> dict[str, FloatArray]:
    """Every number of the state and of other observations: its name, or feature.3, -> (n,)."""
    found: dict[str, FloatArray] = {}
    for feature, described in dataset.features.items():
        if not feature.startswith("observation.") or not str(described["dtype"]).startswith(("float", "int")):
            continue
        values = _array(table, feature).reshape(table.num_rows, -1)
        names = described.get("names")
        names = next(iter(names.values())) if isinstance(names, dict) and names else names
        names = names[0] if names and isinstance(names[0], list) else names
        for column in range(values.shape[1]):
            usable = names and len(names) == values.shape[1] and feature == STATE
            found[str(names[column]) if usable else f"{feature}.{column}"] = values[:, column]
    return found


def _array(table: Any, feature: str) -> FloatArray:
    return np.asarray(table.column(feature).to_pylist(), dtype=np.float64)


def _table(path: Path) -> Any:
    with extra("import"):
        import pyarrow
        import pyarrow.parquet
    if not path.is_file():
        raise CorruptData(path, "the file is missing", _REMEDY)
    try:
        return pyarrow.parquet.read_table(path)
    except (pyarrow.ArrowException, OSError) as error:
        raise CorruptData(path, f"cannot be read ({error})", _REMEDY) from error


def _mask(chosen: Any) -> Any:
    with extra("import"):
        import pyarrow
    return pyarrow.array(chosen)


def _image(table: Any, feature: str, frame: int) -> Image.Image:
    stored = table.column(feature)[frame].as_py()
    try:
        with Image.open(io.BytesIO(stored["bytes"])) as image:
            image.load()
            return image.copy()
    except Exception as error:  # a damaged image can fail in any way at all
        problem = f"the image of frame {frame} cannot be read ({type(error).__name__}: {error})"
        raise CorruptData(feature, problem, _REMEDY) from error
