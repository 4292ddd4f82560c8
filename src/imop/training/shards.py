"""Pairs in files: clouds are stored once, however many pairs share them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from imop.errors import CorruptData
from imop.files import replaced
from imop.geometry.cloud import PointCloud
from imop.training.pairs import StepPair

VERSION = 1


def write_shard(pairs: Sequence[StepPair], path: Path) -> None:
    """Write pairs as one compressed .npz file, whole or not at all."""
    clouds: dict[int, PointCloud] = {}
    for pair in pairs:
        clouds |= {id(c): c for c in (pair.support, pair.after, pair.query)}
    number = {key: i for i, key in enumerate(clouds)}
    every = list(clouds.values())
    arrays: dict[str, NDArray[Any]] = {
        "version": np.array(VERSION),
        "points": np.concatenate([c.points for c in every]).astype(np.float32),
        "colors": np.concatenate([np.round(c.colors * 255) for c in every]).astype(np.uint8),
        "normals": np.concatenate([np.round(_normals(c) * 127) for c in every]).astype(np.int8),
        "camera": np.concatenate([c.camera for c in every]).astype(np.uint8),
        "cloud_start": _starts([len(c) for c in every]),
        "pair_clouds": np.array([[number[id(c)] for c in (p.support, p.after, p.query)] for p in pairs]),
        "region": np.concatenate([p.region for p in pairs]),
        "region_start": _starts([len(p.region) for p in pairs]),
        "poses": np.stack([np.stack([p.T_world_goal, p.T_world_now]) for p in pairs]),
        "gripper": np.array([p.gripper_open for p in pairs]),
        "motions": np.concatenate([p.T_query_support for p in pairs]),
        "motion_start": _starts([len(p.T_query_support) for p in pairs]),
    }
    with replaced(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)


class Shard:
    """The pairs of one file, read into memory.

    Raises:
        CorruptData: if the file is not a whole shard of this version.
    """

    def __init__(self, path: Path):
        try:
            with np.load(path, allow_pickle=False) as file:
                self._arrays: dict[str, NDArray[Any]] = {name: file[name] for name in file.files}
            version = int(self._arrays["version"])
        except Exception as error:
            raise CorruptData(
                path, f"is not a shard of training pairs ({error})", "generate it again"
            ) from error
        if version != VERSION:
            raise CorruptData(path, f"has version {version}, not {VERSION}", "generate it again")

    def __len__(self) -> int:
        return len(self._arrays["pair_clouds"])

    def __getitem__(self, index: int) -> StepPair:
        a = self._arrays
        support, after, query = (self._cloud(int(c)) for c in a["pair_clouds"][index])
        first, last = a["region_start"][index : index + 2]
        begin, end = a["motion_start"][index : index + 2]
        goal, now = a["poses"][index]
        opened = (bool(a["gripper"][index, 0]), bool(a["gripper"][index, 1]))
        region, motions = a["region"][first:last], a["motions"][begin:end]
        return StepPair(support, after, query, region, goal, now, opened, motions)

    def _cloud(self, number: int) -> PointCloud:
        a = self._arrays
        part = slice(*a["cloud_start"][number : number + 2])
        normals = a["normals"][part].astype(np.float64)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
        colors = a["colors"][part].astype(np.float32) / np.float32(255)
        points = a["points"][part].astype(np.float64)
        return PointCloud(points, colors, a["camera"][part].astype(np.int32), normals)


def _normals(cloud: PointCloud) -> NDArray[np.float64]:
    assert cloud.normals is not None
    return cloud.normals


def _starts(lengths: Sequence[int]) -> NDArray[np.int64]:
    return np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
