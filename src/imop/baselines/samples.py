"""What the regressors are trained on: a thin cloud and the gripper at a keyframe, and the action there.

Clouds are made once per episode of a store and kept in a small file, so that training decodes no images.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from imop.baselines.words import numbers_of
from imop.demos.store import DemonstrationStore
from imop.errors import CorruptData, InvalidInput
from imop.files import read, replaced
from imop.geometry import cloud as clouds
from imop.geometry.cloud import PointCloud
from imop.geometry.perception import (
    WORKSPACE_LOWER,
    WORKSPACE_UPPER,
    Perception,
    find_ground,
    open_ground,
    open_plane,
)
from imop.types import BoolArray, ByteArray, Demonstration, Float32Array, FloatArray, Observation

POINTS = 4096
"""Points of a thin cloud."""
CENTER = (np.array(WORKSPACE_LOWER) + np.array(WORKSPACE_UPPER)) / 2
"""(3,) the middle of the workspace, a cube with an edge of 1 m; samples are in a frame with this origin."""
_GROUND_VOXEL = 0.035
_STEPS = 2**16 - 1
_BITS = 10

UnsignedArray = NDArray[np.uint16]


@dataclass(frozen=True, eq=False)
class Samples:
    """N keyframes. Poses are of the gripper in a frame with the world's axes and the origin `CENTER`, metres.

    Attributes:
        points: (N, POINTS, 3) the cloud without the robot; 0 .. 65535 across the workspace.
        colors: (N, POINTS, 3) 0 .. 255.
        gripper: (N, 4, 4) where the gripper is.
        opening: (N,) 0 closed .. 1 open.
        step: (N,) keyframes reached before.
        pose: (N, 4, 4) where the action takes the gripper.
        gripper_open: (N,) its state afterwards.
        allow_collisions: (N,) whether the motion may touch things.
        episode: (N,) number of the demonstration.
        instructions: one for each demonstration.
    """

    points: UnsignedArray
    colors: ByteArray
    gripper: Float32Array
    opening: Float32Array
    step: NDArray[np.int64]
    pose: Float32Array
    gripper_open: BoolArray
    allow_collisions: BoolArray
    episode: NDArray[np.int64]
    instructions: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.points)

    @cached_property
    def words(self) -> NDArray[np.int64]:
        """(demonstrations, LENGTH) numbers of the words of each instruction."""
        return np.stack([numbers_of(instruction) for instruction in self.instructions])

    def of(self, episodes: Sequence[int] | NDArray[np.int64]) -> NDArray[np.int64]:
        """Numbers of the samples of these demonstrations."""
        return np.flatnonzero(np.isin(self.episode, episodes))


def thin(cloud: PointCloud, seed: int = 0) -> tuple[UnsignedArray, ByteArray]:
    """`POINTS` points of a cloud of the workspace and their colours, as `Samples` has them.

    Bare ground is thinned first, then what stands on it. Points follow each other along a Z-shaped curve, so
    that successive ones lie together. Too few points are repeated.
    """
    rng = np.random.default_rng(seed)
    plane = open_plane(cloud.points[open_ground(cloud.points)])
    bare = np.zeros(len(cloud), dtype=bool) if plane is None else find_ground(cloud, plane).bare
    ground = clouds.voxel_downsample(cloud.select(bare), _GROUND_VOXEL) if bare.any() else cloud.select(bare)
    ground = ground.select(rng.permutation(len(ground))[: POINTS // 4])
    things = np.flatnonzero(~bare)
    things = rng.permutation(things)[: POINTS - len(ground)]
    points = np.concatenate([cloud.points[things], ground.points])
    colors = np.concatenate([cloud.colors[things], ground.colors])
    chosen = np.concatenate([np.arange(len(points)), rng.integers(len(points), size=POINTS - len(points))])
    steps = np.round((points[chosen] - CENTER + 0.5) * _STEPS).clip(0, _STEPS).astype(np.uint16)
    order = np.argsort(_along_curve(steps), kind="stable")
    return steps[order], np.round(colors[chosen][order] * 255).astype(np.uint8)


def metres(points: UnsignedArray) -> Float32Array:
    """Points (..., 3) as `Samples` has them, in its frame."""
    return np.asarray(points.astype(np.float32) / _STEPS - 0.5, dtype=np.float32)


def _along_curve(steps: UnsignedArray) -> NDArray[np.int64]:
    """(N,) place of each cell on a Z-shaped (Morton) curve through space."""
    cells = (steps >> (16 - _BITS)).astype(np.int64)
    code = np.zeros(len(cells), dtype=np.int64)
    for bit in range(_BITS):
        for axis in range(3):
            code |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return code


def centered(T: FloatArray) -> Float32Array:
    """A pose (4, 4) of the world in the frame of `Samples`."""
    moved = np.array(T, dtype=np.float32)
    moved[:3, 3] = T[:3, 3] - CENTER
    return moved


def seen(perception: Perception, observation: Observation) -> dict[str, Any]:
    """What a regressor sees of one state, by the names of `Samples`.

    Raises:
        InvalidInput: if nothing is seen in the workspace.
    """
    points, colors = thin(perception.points(observation))
    return {
        "points": points,
        "colors": colors,
        "gripper": centered(observation.T_world_gripper),
        "opening": np.float32(observation.gripper_opening),
        "step": np.int64(observation.time_step),
    }


def samples_of(perception: Perception, demonstration: Demonstration) -> Samples:
    """All keyframes of one demonstration.

    Raises:
        InvalidInput: if it has no instruction, or nothing is seen in the workspace.
    """
    if not demonstration.instructions:
        raise InvalidInput("instructions", "none", "a demonstration that says in words what is done")
    rows = [
        {
            **seen(perception, keyframe.observation),
            "pose": centered(keyframe.action.T_world_gripper),
            "gripper_open": np.bool_(keyframe.action.gripper_open),
            "allow_collisions": np.bool_(keyframe.action.allow_collisions),
            "episode": np.int64(0),
        }
        for keyframe in demonstration.keyframes
    ]
    return Samples(
        **{name: np.stack([row[name] for row in rows]) for name in rows[0]},
        instructions=demonstration.instructions[:1],
    )


def joined(parts: Sequence[Samples]) -> Samples:
    """All samples of `parts`, whose demonstrations are numbered through."""
    names = [field.name for field in fields(Samples) if field.name not in ("episode", "instructions")]
    counts = np.cumsum([0, *(len(part.instructions) for part in parts)])
    episode = np.concatenate([part.episode + n for part, n in zip(parts, counts[:-1], strict=True)])
    return Samples(
        **{name: np.concatenate([getattr(part, name) for part in parts]) for name in names},
        episode=episode,
        instructions=tuple(one for part in parts for one in part.instructions),
    )


def stored_samples(store: Path, cache: Path, perception: Perception) -> Samples:
    """All samples of a store of demonstrations; what the cache lacks is made and put there.

    Args:
        store: as `imop collect` writes it.
        cache: folder with one file per episode, named by its digest; made if missing.
        perception: makes clouds, without the robot.

    Raises:
        InvalidInput: if there is no store, or nothing in it.
        CorruptData: if an episode or a cached file cannot be read.
    """
    opened = DemonstrationStore.open(store, verify=False)
    count, parts = len(opened), []
    if not count:
        raise InvalidInput("stores", f"{store} is empty", "a store with demonstrations")
    for index in range(count):
        file = cache / f"{opened.digest(index)[:20]}.npz"
        if not file.is_file():
            _save(file, samples_of(perception, opened[index]))
        parts.append(_load(file))
    return joined(parts)


def _save(file: Path, samples: Samples) -> None:
    with replaced(file) as temporary, temporary.open("wb") as stream:
        np.savez(stream, **{field.name: getattr(samples, field.name) for field in fields(Samples)})


def _load(file: Path) -> Samples:
    remedy = "remove it, it is made again"
    try:
        with np.load(BytesIO(read(file, remedy))) as arrays:
            known = {field.name: arrays[field.name] for field in fields(Samples)}
        return Samples(**{**known, "instructions": tuple(known["instructions"].tolist())})
    except (ValueError, KeyError, TypeError, OSError) as error:
        raise CorruptData(file, f"holds no samples ({error})", remedy) from error
