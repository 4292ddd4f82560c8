"""What a pair may look like without its truth changing."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch

from imop.geometry import se3
from imop.geometry.cloud import PointCloud
from imop.networks.graph import Graph
from imop.training.data.camera_error import camera_errors
from imop.training.data.pairs import Carry, StepPair
from imop.types import BoolArray, FloatArray

MOVE = 0.15
TILT = 0.03
JITTER = 0.001
KEEP_POINTS = (0.6, 1.0)
LOSE_VIEW = 0.15
# Fewer points are not thinned out further.
ENOUGH = 100


def augment(pair: StepPair, rng: np.random.Generator) -> StepPair:
    """The pair with both scenes moved independently, in other light, and seen less well.

    Both sides turn freely about the vertical, move by up to `MOVE` metres and tilt by up to `TILT` radians;
    poses, normals and the right motions go with them. Half of all pairs are mirrored first. Colours change
    together and a little apart; points and whole views are lost; views are a little off.
    """
    if rng.random() < 0.5:
        pair = mirrored(pair)
    pair = camera_errors(pair, rng)
    A, B = _motion(rng, pair.T_world_goal[:3, 3]), _motion(rng, pair.query.points.mean(axis=0))
    light = random_light(rng, 0.25)
    support, kept = _worse(pair.support, rng, pair.region)
    after, _ = _worse(pair.after, rng)
    query, _ = _worse(pair.query, rng)
    light_query = light @ random_light(rng, 0.06)
    return replace(
        pair,
        support=_moved(_lit(support, light), A),
        after=_moved(_lit(after, light), A),
        query=_moved(_lit(query, light_query), B),
        region=pair.region[kept],
        invariance=None if pair.invariance is None else pair.invariance[kept],
        T_world_goal=A @ pair.T_world_goal,
        T_world_now=A @ pair.T_world_now,
        T_query_support=B @ pair.T_query_support @ se3.invert(A),
        carry=pair.carry and Carry(_moved(_worse(pair.carry.after, rng)[0], A), A @ pair.carry.T_world_hand),
    )


def mirrored(pair: StepPair) -> StepPair:
    """The pair in a mirror, both scenes and all poses. A parallel gripper is its own mirror image."""
    M = np.diag([1.0, -1.0, 1.0, 1.0])

    def cloud(seen: PointCloud) -> PointCloud:
        flip = np.array([1.0, -1.0, 1.0])
        normals = None if seen.normals is None else seen.normals * flip
        return replace(seen, points=seen.points * flip, normals=normals)

    return replace(
        pair,
        support=cloud(pair.support),
        after=cloud(pair.after),
        query=cloud(pair.query),
        T_world_goal=M @ pair.T_world_goal @ M,
        T_world_now=M @ pair.T_world_now @ M,
        T_query_support=M @ pair.T_query_support @ M,
        carry=pair.carry and Carry(cloud(pair.carry.after), M @ pair.carry.T_world_hand @ M),
    )


def _motion(rng: np.random.Generator, center: FloatArray) -> FloatArray:
    roll, pitch = rng.normal(0, TILT / 2, 2).clip(-TILT, TILT)
    R = se3.euler(roll, pitch, rng.uniform(-np.pi, np.pi))
    shift = np.array([*rng.uniform(-MOVE, MOVE, 2), 0.0])
    return se3.make(R, center + shift - R @ center)


def random_light(rng: np.random.Generator, strength: float) -> FloatArray:
    """(3, 3) random gain of each channel with a little mixing between them."""
    return np.diag(np.exp(rng.normal(0, strength, 3))) @ (np.eye(3) + rng.normal(0, 0.3 * strength, (3, 3)))


def _lit(cloud: PointCloud, light: FloatArray) -> PointCloud:
    return replace(cloud, colors=np.clip(cloud.colors @ light.T, 0, 1).astype(np.float32))


def _moved(cloud: PointCloud, T: FloatArray) -> PointCloud:
    normals = None if cloud.normals is None else se3.rotate(T, cloud.normals)
    return replace(cloud, points=se3.apply(T, cloud.points), normals=normals)


def _worse(
    cloud: PointCloud, rng: np.random.Generator, region: BoolArray | None = None
) -> tuple[PointCloud, BoolArray]:
    """Fewer and noisier points, and (N,) which are kept; at least one of the region stays."""
    keep = np.ones(len(cloud), dtype=bool)
    if len(cloud) > ENOUGH:
        keep = rng.random(len(cloud)) < rng.uniform(*KEEP_POINTS)
        cameras = np.unique(cloud.camera)
        if len(cameras) > 1 and rng.random() < LOSE_VIEW:
            keep &= cloud.camera != rng.choice(cameras)
        if (region is not None and not (keep & region).any()) or keep.sum() < ENOUGH:
            keep[:] = True
    thinner = cloud.select(keep)
    noisy = thinner.points + rng.normal(0, JITTER, thinner.points.shape)
    return replace(thinner, points=noisy), keep


def other_light(graph: Graph, lights: Sequence[FloatArray]) -> Graph:
    """The same clouds in other light, one (3, 3) for each; places stay, nothing has to be searched anew."""
    light = torch.from_numpy(np.stack(lights).astype(np.float32))[graph.cloud]
    features = graph.features.clone()
    lit = ((features[:, None, :3] + 0.5) * light).sum(dim=2)
    features[:, :3] = lit.clamp(0, 1) - 0.5
    return replace(graph, features=features)
