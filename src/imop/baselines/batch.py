"""Samples as tensors, moved about as the papers of the regressors do it."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from torch import Tensor

from imop.baselines.samples import Samples, metres
from imop.types import Float32Array

SHIFT, TURN = 0.125, np.pi / 4
"""Largest shift along each axis (metres) and turn about the vertical (radians) of the augmentation."""


@dataclass(frozen=True, eq=False)
class Inputs:
    """What is known of B states, in the frame of `Samples`.

    Attributes:
        points: (B, N, 3) metres.
        colors: (B, N, 3) 0 .. 1.
        words: (B, L) numbers of the words.
        gripper: (B, 4, 4) its pose.
        opening: (B,) 0 closed .. 1 open.
        step: (B,) keyframes reached before.
    """

    points: Tensor
    colors: Tensor
    words: Tensor
    gripper: Tensor
    opening: Tensor
    step: Tensor


@dataclass(frozen=True, eq=False)
class Targets:
    """Actions of B states, in the frame of `Samples`.

    Attributes:
        pose: (B, 4, 4) of the gripper.
        gripper_open: (B,) 1 if it is open afterwards, else 0.
        allow_collisions: (B,) likewise.
    """

    pose: Tensor
    gripper_open: Tensor
    allow_collisions: Tensor


def inputs_of(seen: dict[str, Any], words: NDArray[np.int64]) -> Inputs:
    """One state, see `samples.seen`, as a batch."""
    rows = {name: np.asarray(value)[None] for name, value in seen.items()}
    points = metres(rows.pop("points"))
    colors = rows.pop("colors").astype(np.float32) / 255
    return Inputs(**_tensors(Inputs, {**rows, "points": points, "colors": colors, "words": words[None]}))


def batch_of(
    samples: Samples, numbers: NDArray[np.int64], rng: np.random.Generator | None = None
) -> tuple[Inputs, Targets]:
    """The samples of these numbers, each moved at random if there is an `rng`."""
    rows = {
        field.name: getattr(samples, field.name)[numbers]
        for field in fields(Samples)
        if field.name not in ("episode", "instructions")
    }
    rows["points"] = metres(rows["points"])
    rows["colors"] = rows["colors"].astype(np.float32) / 255
    if rng is not None:
        T = np.stack([random_motion(pose, rng) for pose in rows["pose"]])
        rows["points"] = rows["points"] @ np.swapaxes(T[:, :3, :3], 1, 2) + T[:, None, :3, 3]
        rows["gripper"], rows["pose"] = T @ rows["gripper"], T @ rows["pose"]
    rows["words"] = samples.words[samples.episode[numbers]]
    for name in ("gripper_open", "allow_collisions"):
        rows[name] = rows[name].astype(np.float32)
    return Inputs(**_tensors(Inputs, rows)), Targets(**_tensors(Targets, rows))


def random_motion(pose: Float32Array, rng: np.random.Generator) -> Float32Array:
    """(4, 4) a turn about the vertical through the target and a shift that leaves it in the workspace.

    Args:
        pose: (4, 4) the target.
        rng: draws up to `TURN` and `SHIFT`.
    """
    p = pose[:3, 3]
    T: Float32Array = np.eye(4, dtype=np.float32)
    T[:3, :3] = Rotation.from_euler("z", rng.uniform(-TURN, TURN)).as_matrix()
    lowest, highest = np.minimum(p, -0.5), np.maximum(p, 0.5)  # a target outside stays where it is
    T[:3, 3] = (p + rng.uniform(-SHIFT, SHIFT, 3)).clip(lowest, highest) - T[:3, :3] @ p
    return T


def _tensors(kind: type[Inputs] | type[Targets], rows: dict[str, Any]) -> dict[str, Tensor]:
    return {field.name: torch.from_numpy(np.ascontiguousarray(rows[field.name])) for field in fields(kind)}
