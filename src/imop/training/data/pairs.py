"""One training example: a demonstrated step, a state that calls for the same action, and what is right."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.geometry.cloud import PointCloud, farthest_points
from imop.geometry.neighbours import nearest
from imop.networks.graph import Graph, GraphConfig, build_graph, collate, thin
from imop.networks.region import StepBatch, Transport, cross_neighbours, fates, next_transport
from imop.types import BoolArray, FloatArray, as_array, as_pose

# A region point and its counterpart in the query are at most this far apart after the true motion, metres.
MATCH_RADIUS = 0.02


@dataclass(frozen=True, eq=False)
class Carry:
    """A later step of the demonstration that begins with closed fingers: what is taken goes with the hand.

    Attributes:
        after: the state that it led to.
        T_world_hand: (2, 4, 4) the gripper when it began and when it ended.
    """

    after: PointCloud
    T_world_hand: FloatArray


def next_carry(
    opened: Sequence[bool], T_world_hand: Sequence[FloatArray], clouds: Sequence[PointCloud], step: int
) -> Carry | None:
    """The next carry after a step; None if it is the step itself, or there is none.

    Args:
        opened: whether the gripper is open before each step of a demonstration.
        T_world_hand: (4, 4) the gripper before each step, and after the last.
        clouds: of the same states.
        step: number.
    """
    carry = next_transport(opened, step)
    return None if carry == step else Carry(clouds[carry + 1], np.stack(T_world_hand[carry : carry + 2]))


@dataclass(frozen=True, eq=False)
class StepPair:
    """A step (s_i, T_i, s_i') and a query s_j with s_i = s_j in the sense of the paper.

    Attributes:
        support: s_i with normals, without the robot.
        after: s_i'.
        query: s_j.
        region: (N,) True for the points of `support` in the invariant region.
        T_world_goal: (4, 4) the action pose T_i, world frame of the demonstration.
        T_world_now: (4, 4) the gripper in s_i.
        gripper_open: whether it is open in s_i, and after the action.
        T_query_support: (S, 4, 4) every right motion of the region from s_i to s_j, S >= 1: several where the
            region is symmetric or the query shows equal instances.
        invariance: (N,) how far points of the region are from their counterparts on the query's thing, both
            seen from the action, metres; NaN outside the region and where it is not known. None if the
            shapes are equal: all zero.
        carry: the next one; None if it is this step, or there is none.
    """

    support: PointCloud
    after: PointCloud
    query: PointCloud
    region: BoolArray
    T_world_goal: FloatArray
    T_world_now: FloatArray
    gripper_open: tuple[bool, bool]
    T_query_support: FloatArray
    invariance: FloatArray | None = None
    carry: Carry | None = None

    @property
    def clouds(self) -> tuple[PointCloud, PointCloud, PointCloud, PointCloud]:
        """s_i, s_i', s_j and the state after the next carry; s_i' again if there is none."""
        return self.support, self.after, self.query, self.after if self.carry is None else self.carry.after

    def __post_init__(self) -> None:
        for name in ("support", "after", "query"):
            if not len(getattr(self, name)):
                raise InvalidInput(name, "empty cloud", "at least one point")
        region = as_array("region", self.region, (len(self.support),), np.bool_)
        if not region.any():
            raise InvalidInput("region", "no point is in it", "at least one True")
        as_pose("T_world_goal", self.T_world_goal)
        as_pose("T_world_now", self.T_world_now)
        for T in as_array("T_query_support", self.T_query_support, (None, 4, 4)):
            as_pose("T_query_support", T)
        if not len(self.T_query_support):
            raise InvalidInput("T_query_support", "no motion", "at least one right motion")
        if self.invariance is not None:
            as_array("invariance", self.invariance, (len(self.support),), np.float64)
        if self.carry is not None:
            for T in as_array("carry", self.carry.T_world_hand, (2, 4, 4)):
                as_pose("carry", T)


@dataclass(frozen=True, eq=False)
class Sample:
    """A `StepPair` as graphs and targets.

    Attributes:
        before: s_i.
        after: s_i'.
        query: s_j.
        poses: (2, 4, 4) float32: T_i and the gripper in s_i.
        gripper: (2,) float32.
        cross, cross_back: nearest points between s_i and s_i'.
        fate, past: what became of the points of s_i, and where those of s_i' come from.
        region: (M,) float32, 1 in the region, of the finest points of `before`.
        invariance: (M,) float32 metres, as in `StepPair`; NaN outside the region and where it is not known.
        chosen: (R,) int64, the points that are matched.
        targets: for each right motion (P, 2) int64: index into `chosen`, index into the query's points.
        right: (S, 4, 4) float64, the right motions themselves.
    """

    before: Graph
    after: Graph
    query: Graph
    poses: Tensor
    gripper: Tensor
    cross: Tensor
    cross_back: Tensor
    fate: Tensor
    past: Tensor
    region: Tensor
    invariance: Tensor
    chosen: Tensor
    targets: tuple[Tensor, ...]
    right: Tensor


@dataclass(frozen=True, eq=False)
class PairBatch:
    """Samples side by side.

    Attributes:
        step: what the region network sees.
        query: s_j, a batch.
        region: (M,) targets of the region network.
        invariance: (M,) metres, NaN where there is no target.
        chosen: (R,) indices into the finest points of all `step.before`.
        targets: per sample, per right motion: (P, 2) row and column of the sample's correspondence matrix.
        right: per sample (S, 4, 4) float64, the right motions; stays on the CPU.
    """

    step: StepBatch
    query: Graph
    region: Tensor
    invariance: Tensor
    chosen: Tensor
    targets: tuple[tuple[Tensor, ...], ...]
    right: tuple[Tensor, ...]

    def to(self, device: torch.device | str) -> "PairBatch":
        """The same batch on a device."""
        targets = tuple(tuple(pairs.to(device) for pairs in motions) for motions in self.targets)
        rest = (self.region.to(device), self.invariance.to(device), self.chosen.to(device))
        return PairBatch(self.step.to(device), self.query.to(device), *rest, targets, self.right)


def make_sample(
    pair: StepPair, config: GraphConfig, max_region: int, rng: np.random.Generator, region_first: bool = True
) -> Sample:
    """Graphs and targets of a pair.

    Args:
        pair: the pair.
        config: how clouds become graphs.
        max_region: cap on the points that are matched.
        rng: chooses which points of the region are matched if there are too many.
        region_first: if False, spread-out points of the whole support state are matched; those that are not
            of the region have no target.
    """
    before, after, query = (build_graph(c, config) for c in (pair.support, pair.after, pair.query))
    p_before = before.points.numpy().astype(np.float64)
    stored = nearest(p_before, pair.support.points)[1][:, 0]
    label = pair.region[stored]
    if not label.any():
        # The region is smaller than the grid: its nearest point stands for it.
        label[nearest(pair.support.points[pair.region], p_before)[1][0, 0]] = True
    chosen = np.flatnonzero(label) if region_first else np.sort(farthest_points(p_before, max_region))
    if len(chosen) > max_region:
        chosen = np.sort(rng.choice(chosen, max_region, replace=False))
    far = np.zeros(len(stored)) if pair.invariance is None else pair.invariance[stored]
    poses = torch.from_numpy(np.stack([pair.T_world_goal, pair.T_world_now]).astype(np.float32))
    # What is known to have no counterpart near is matched to nothing, whatever else lies there.
    matched = label & ~(far > MATCH_RADIUS)
    return Sample(
        before,
        after,
        query,
        poses,
        torch.tensor(pair.gripper_open, dtype=torch.float32),
        *cross_neighbours(before, after, config.neighbours),
        *fates(before, after, poses, _transport(pair, config)),
        torch.from_numpy(label.astype(np.float32)),
        torch.from_numpy(np.where(label, far, np.nan).astype(np.float32)),
        torch.from_numpy(chosen),
        match_targets(p_before[chosen], matched[chosen], query, pair.T_query_support),
        torch.from_numpy(np.array(pair.T_query_support, dtype=np.float64)),
    )


def _transport(pair: StepPair, config: GraphConfig) -> Transport | None:
    if pair.carry is None:
        return None
    return Transport(thin(pair.carry.after, config)[0].points, pair.carry.T_world_hand)


def match_targets(
    p_chosen: FloatArray, region: BoolArray, query: Graph, T_query_support: FloatArray
) -> tuple[Tensor, ...]:
    """For each right motion (S, 4, 4) its pairs (P, 2): chosen point, query point nearest to where it goes.

    Chosen points (R, 3) outside the `region` (R,) have no pair. Nor have hidden ones, without a query point
    nearer than `MATCH_RADIUS`. A motion that hides the whole region is left out, unless all do; then its
    pairs are empty.
    """
    p_query = query.points.numpy().astype(np.float64)
    found = []
    for T in T_query_support:
        distance, index = nearest(se3.apply(T, p_chosen), p_query)
        seen = np.flatnonzero(region & (distance[:, 0] < MATCH_RADIUS))
        found.append(torch.from_numpy(np.stack([seen, index[seen, 0]], axis=1).astype(np.int64)))
    some = [pairs for pairs in found if len(pairs)]
    return tuple(some or found[:1])


def collate_samples(samples: Sequence[Sample]) -> PairBatch:
    """One batch of several samples."""
    before = collate([s.before for s in samples])
    after = collate([s.after for s in samples])
    first_before = _starts([len(s.before.points) for s in samples])
    first_after = _starts([len(s.after.points) for s in samples])
    poses = torch.stack([s.poses for s in samples])
    step = StepBatch(
        before,
        after,
        poses[:, 0],
        poses[:, 1],
        torch.stack([s.gripper for s in samples]),
        torch.cat([s.cross + start for s, start in zip(samples, first_after, strict=True)]),
        torch.cat([s.cross_back + start for s, start in zip(samples, first_before, strict=True)]),
        torch.cat([s.fate for s in samples]),
        torch.cat([s.past for s in samples]),
    )
    return PairBatch(
        step,
        collate([s.query for s in samples]),
        torch.cat([s.region for s in samples]),
        torch.cat([s.invariance for s in samples]),
        torch.cat([s.chosen + start for s, start in zip(samples, first_before, strict=True)]),
        tuple(s.targets for s in samples),
        tuple(s.right for s in samples),
    )


def _starts(lengths: list[int]) -> NDArray[np.int64]:
    return np.concatenate([[0], np.cumsum(lengths)[:-1]]).astype(np.int64)
