"""Pairs in files: clouds are stored once, however many pairs share them."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from imop.errors import CorruptData
from imop.files import replaced
from imop.geometry.cloud import PointCloud
from imop.networks.graph import GraphConfig
from imop.training.data.pairs import Carry, StepPair
from imop.types import FloatArray

VERSION = 2
SHARD = 500
"""So many pairs lie in a file."""
STORED = GraphConfig(voxel=0.007, plane_voxel=0.03, max_points=1500)
"""Clouds are stored about twice as dense as networks see them."""

Arrays = Mapping[str, NDArray[Any]]


def write_shard(pairs: Sequence[StepPair], path: Path) -> None:
    """Write pairs as one compressed .npz file, whole or not at all."""
    clouds = {id(c): c for pair in pairs for c in pair.clouds}
    number = {key: i for i, key in enumerate(clouds)}
    arrays: dict[str, NDArray[Any]] = {
        "version": np.array(VERSION),
        **cloud_arrays(list(clouds.values())),
        "pair_clouds": np.array([[number[id(c)] for c in p.clouds] for p in pairs]),
        "region": np.concatenate([p.region for p in pairs]),
        "region_start": starts([len(p.region) for p in pairs]),
        "invariance": np.concatenate([_invariance(p) for p in pairs]),
        "other_shape": np.array([p.invariance is not None for p in pairs]),
        "poses": np.stack([np.stack([p.T_world_goal, p.T_world_now, *_hands(p)]) for p in pairs]),
        "carried": np.array([p.carry is not None for p in pairs]),
        "gripper": np.array([p.gripper_open for p in pairs]),
        "motions": np.concatenate([p.T_query_support for p in pairs]),
        "motion_start": starts([len(p.T_query_support) for p in pairs]),
    }
    write_arrays(arrays, path)


class Shard:
    """The pairs of one file, read into memory.

    Raises:
        CorruptData: if the file is not a whole shard of this version.
    """

    def __init__(self, path: Path):
        self._arrays = read_arrays(path, VERSION, "pair_clouds")

    def __len__(self) -> int:
        return len(self._arrays["pair_clouds"])

    @property
    def clouds(self) -> NDArray[np.int64]:
        """(N, 3) numbers of the clouds of each pair: s_i, s_i', s_j; equal numbers are the same cloud."""
        return self._arrays["pair_clouds"][:, :3]

    def __getitem__(self, index: int) -> StepPair:
        a = self._arrays
        support, after, query, later = (read_cloud(a, int(c)) for c in a["pair_clouds"][index])
        first, last = a["region_start"][index : index + 2]
        begin, end = a["motion_start"][index : index + 2]
        goal, now, *hands = a["poses"][index]
        opened = (bool(a["gripper"][index, 0]), bool(a["gripper"][index, 1]))
        region, motions = a["region"][first:last], a["motions"][begin:end]
        invariance = a["invariance"][first:last].astype(np.float64) if a["other_shape"][index] else None
        carry = Carry(later, np.stack(hands)) if a["carried"][index] else None
        return StepPair(support, after, query, region, goal, now, opened, motions, invariance, carry)


def cloud_arrays(clouds: Sequence[PointCloud]) -> dict[str, NDArray[Any]]:
    """Clouds with normals, one after the other, as `read_cloud` expects them: rounded, without ids."""
    return {
        "points": np.concatenate([c.points for c in clouds]).astype(np.float32),
        "colors": np.concatenate([np.round(c.colors * 255) for c in clouds]).astype(np.uint8),
        "normals": np.concatenate([np.round(_normals(c) * 127) for c in clouds]).astype(np.int8),
        "camera": np.concatenate([c.camera for c in clouds]).astype(np.uint8),
        "cloud_start": starts([len(c) for c in clouds]),
    }


def read_cloud(arrays: Arrays, number: int) -> PointCloud:
    """One of the clouds of `cloud_arrays`."""
    part = slice(*arrays["cloud_start"][number : number + 2])
    normals = arrays["normals"][part].astype(np.float64)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    colors = arrays["colors"][part].astype(np.float32) / np.float32(255)
    points = arrays["points"][part].astype(np.float64)
    return PointCloud(points, colors, arrays["camera"][part].astype(np.int32), normals)


def write_arrays(arrays: Arrays, path: Path) -> None:
    """Write one compressed .npz file, whole or not at all."""
    with replaced(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)


def read_arrays(path: Path, version: int, wanted: str) -> dict[str, NDArray[Any]]:
    """Everything in an .npz file.

    Raises:
        CorruptData: if it is damaged, of another version, or has no array `wanted`.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays: dict[str, NDArray[Any]] = {name: file[name] for name in file.files}
        found = int(arrays["version"])
    except Exception as error:
        raise CorruptData(path, f"is not a shard of training data ({error})", "generate it again") from error
    if wanted not in arrays:
        raise CorruptData(path, f"has no {wanted}: it is a shard of another kind")
    if found != version:
        raise CorruptData(path, f"has version {found}, not {version}", "generate it again")
    return arrays


def starts(lengths: Sequence[int]) -> NDArray[np.int64]:
    """(N + 1,) where each of N parts of the given lengths begins, and the end."""
    return np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)


def _hands(pair: StepPair) -> FloatArray:
    """(2, 4, 4), identities without a carry."""
    return np.stack([np.eye(4), np.eye(4)]) if pair.carry is None else pair.carry.T_world_hand


def _invariance(pair: StepPair) -> NDArray[np.float16]:
    """(N,) with zeros for equal shapes. Half floats are exact to 0.1 mm up to 20 cm."""
    zero = np.zeros(len(pair.region))
    return (zero if pair.invariance is None else pair.invariance).astype(np.float16)


def _normals(cloud: PointCloud) -> NDArray[np.float64]:
    assert cloud.normals is not None
    return cloud.normals
