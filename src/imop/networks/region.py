"""The invariant region network: which points of a demonstrated state is the action fixed to, and how firmly?

Paper, section III-C1: graph self attention within s_i and s_i', graph cross attention between them, a
point-wise sigmoid over s_i after every stage. Beyond the paper it says of every point how far off its
counterpart may be, seen from the action, if the thing is another one of its kind: Definition 1's epsilon.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
import torch
from torch import Tensor, nn

from imop.geometry import se3
from imop.geometry.neighbours import nearest
from imop.networks.backbone import Backbone, BackboneConfig, level_relations
from imop.networks.blocks import MLP, GraphBlock, relation
from imop.networks.graph import POINT_FEATURES, Graph, nearest_neighbours
from imop.types import Float32Array, FloatArray

GRIPPER_FEATURES = 16
# Distances (metres) from a point to what is there in the other state, which tell "nothing has changed".
_ALIKE = (0.012, 0.04)
FATES = 4 * len(_ALIKE)
"""What is told of each point: whether it stays and whether it goes with the hand, in the step and in the
next transport."""
REGION_INPUTS = POINT_FEATURES + GRIPPER_FEATURES + FATES
# Counterparts are expected within these distances, metres: the noise of the cameras, and what is no part.
NEAREST, FARTHEST = 0.001, 0.05
# What the cameras and the grid of the cloud leave open, metres.
NOISE = 0.005


@dataclass(frozen=True)
class RegionConfig:
    """Shape of the region network.

    Attributes:
        backbone: shared by s_i and s_i'; its first width is that of the stages.
        stages: rounds of self and cross attention, each with a prediction.
        low_dimensional: whether the gripper's state is among the inputs (the paper's ablation); what goes
            with the gripper is not without it.
    """

    backbone: BackboneConfig = field(default_factory=lambda: BackboneConfig(inputs=REGION_INPUTS))
    stages: int = 2
    low_dimensional: bool = True


@dataclass(frozen=True, eq=False)
class StepBatch:
    """A batch of demonstrated steps as tensors.

    Attributes:
        before: s_i, one cloud per step.
        after: s_i'.
        T_world_goal: (B, 4, 4) the action pose T_i.
        T_world_now: (B, 4, 4) the gripper in s_i.
        gripper: (B, 2) whether it is open in s_i, and after the action.
        cross: (M, K) for each point of `before`, its nearest points of `after`.
        cross_back: (M', K) for each point of `after`, its nearest of `before`.
        fate: (M, FATES) what becomes of each point of `before`; see `fates`.
        past: (M', FATES) where each point of `after` comes from, and what becomes of it.
    """

    before: Graph
    after: Graph
    T_world_goal: Tensor
    T_world_now: Tensor
    gripper: Tensor
    cross: Tensor
    cross_back: Tensor
    fate: Tensor
    past: Tensor

    @property
    def features(self) -> Tensor:
        """(M, GRIPPER_FEATURES) the points of `before` in the gripper's frames; see `gripper_features`."""
        return gripper_features(self.before, self)

    def to(self, device: torch.device | str) -> "StepBatch":
        """The same batch on a device."""
        poses = (self.T_world_goal, self.T_world_now, self.gripper)
        rest = (*poses, self.cross, self.cross_back, self.fate, self.past)
        return StepBatch(self.before.to(device), self.after.to(device), *(t.to(device) for t in rest))


def cross_neighbours(before: Graph, after: Graph, k: int) -> tuple[Tensor, Tensor]:
    """(M, k) for each point of s_i its nearest of s_i', and (M', k) the other way round; of single clouds."""
    p_before, p_after = (g.points.cpu().double().numpy() for g in (before, after))
    forth, back = nearest_neighbours(p_before, p_after, k), nearest_neighbours(p_after, p_before, k)
    return torch.from_numpy(forth), torch.from_numpy(back)


@dataclass(frozen=True, eq=False)
class Transport:
    """A later motion of the closed hand, which shows what an action before it is about to take.

    Attributes:
        p_after: (K, 3) points of the state that it led to, metres.
        T_world_hand: (2, 4, 4) the gripper when it began and when it ended.
    """

    p_after: FloatArray
    T_world_hand: FloatArray


def fates(before: Graph, after: Graph, poses: Tensor, transport: Transport | None) -> tuple[Tensor, Tensor]:
    """(M, FATES) of the points of s_i and (M', FATES) of those of s_i'; of single clouds.

    Nearnesses, 0 to 1, of what another state has where the point is, and of what it has where the hand's
    motion takes the point. What is held or pushed goes with the hand, whatever the action is meant for; what
    goes with it next is what an approach is meant for.

    Args:
        before: s_i.
        after: s_i'.
        poses: (2, 4, 4) T_i and the gripper in s_i, world frame.
        transport: the next one; None if it is the step itself, or there is none.
    """
    T_goal, T_now = poses.double().numpy()
    M = _motion(T_now, T_goal)
    p_before, p_after = (g.points.double().numpy() for g in (before, after))
    own = _told(p_before, p_after, M), _told(p_after, p_before, se3.invert(M))
    next_ = own
    if transport is not None:
        later = transport.p_after, _motion(*transport.T_world_hand)
        next_ = _told(p_before, *later), _told(p_after, *later)
    fate, past = (np.concatenate(both, axis=1) for both in zip(own, next_, strict=True))
    return torch.from_numpy(fate), torch.from_numpy(past)


def _motion(T_begin: FloatArray, T_end: FloatArray) -> FloatArray:
    """(4, 4) what takes the hand, and all that goes with it, from one pose to another."""
    return T_end @ se3.invert(T_begin)


def _told(points: FloatArray, others: FloatArray, motion: FloatArray) -> Float32Array:
    """(N, FATES / 2) nearnesses of points (N, 3), as they are and moved, to others (K, 3)."""
    away = [nearest(p, others)[0] for p in (points, se3.apply(motion, points))]
    columns = [np.exp(-distance / scale) for distance in away for scale in _ALIKE]
    return np.concatenate(columns, axis=1).astype(np.float32)


def next_transport(opened: Sequence[bool], step: int) -> int:
    """The first step, from `step` on, that begins with closed fingers; `step` if there is none.

    Args:
        opened: whether the gripper is open before each step of a demonstration.
        step: number.
    """
    return next((k for k in range(step, len(opened)) if not opened[k]), step)


def one_step(
    before: Graph,
    after: Graph,
    poses: Tensor,
    gripper: Tensor,
    neighbours: int,
    transport: Transport | None = None,
) -> StepBatch:
    """A batch of one step.

    Args:
        before: s_i.
        after: s_i'.
        poses: (2, 4, 4) T_i and the gripper in s_i, world frame.
        gripper: (2,) whether it is open in s_i, and after the action.
        neighbours: K of the cross attention.
        transport: see `fates`.
    """
    cross, told = cross_neighbours(before, after, neighbours), fates(before, after, poses, transport)
    return StepBatch(before, after, poses[:1], poses[1:], gripper[None], *cross, *told)


@dataclass(frozen=True, eq=False)
class RegionPrediction:
    """What the region network says of the points of s_i.

    Attributes:
        stages: (M,) logits of being in the region, one per stage, the last one the best.
        spread: (M,) metres, `NEAREST` to `FARTHEST`: how far the counterpart of a point on another thing of
            the same kind is expected from it, both seen from the action. It means something in the region.
    """

    stages: list[Tensor]
    spread: Tensor

    @property
    def probability(self) -> Tensor:
        """(M,) of being in the region."""
        return torch.sigmoid(self.stages[-1].float())

    @property
    def trust(self) -> Tensor:
        """(M,) weights of a fit to another thing: 1 where nothing is expected to differ, else less."""
        return trust(self.spread)


Values = TypeVar("Values", Tensor, FloatArray)


def trust(spread: Values) -> Values:
    """Weights of points with a spread, metres, in a fit: 1 / (1 + (spread / `NOISE`)^2)."""
    return 1 / (1 + (spread / NOISE) ** 2)


class RegionNetwork(nn.Module):
    """Steps -> region and invariance of the points of s_i."""

    def __init__(self, config: RegionConfig):
        super().__init__()
        self.config = config
        self.backbone = Backbone(config.backbone)
        width = config.backbone.widths[0]
        groups = width // config.backbone.group_width

        def blocks(count: int, cross: bool) -> nn.ModuleList:
            return nn.ModuleList(GraphBlock(width, groups, cross) for _ in range(count))

        stages = config.stages
        self.across, self.within = blocks(stages, True), blocks(stages, False)
        # Nobody asks for s_i' after the last stage.
        self.across_back, self.within_after = blocks(stages - 1, True), blocks(stages - 1, False)
        self.heads = nn.ModuleList(
            nn.Sequential(nn.LayerNorm(width), nn.Linear(width, 1)) for _ in range(config.stages)
        )
        self.spread = nn.Sequential(nn.LayerNorm(width), MLP(width, width, 1))

    def forward(self, steps: StepBatch) -> RegionPrediction:
        """Region and invariance of a batch of steps."""
        before, after = steps.before, steps.after
        x = self.backbone(before, self._inputs(before, steps, steps.fate))
        y = self.backbone(after, self._inputs(after, steps, steps.past))
        r_before, r_after = level_relations(before.levels[0]), level_relations(after.levels[0])
        r_cross = _cross_relations(before, after, steps.cross)
        r_back = _cross_relations(after, before, steps.cross_back)
        logits = []
        for k in range(self.config.stages):
            # Both directions read the features from before the stage, as in the paper's code.
            asking, answering = x, y
            x = self.across[k](asking, steps.cross, r_cross, answering)
            x = self.within[k](x, before.levels[0].neighbours, r_before)
            if k < len(self.across_back):
                y = self.across_back[k](answering, steps.cross_back, r_back, asking)
                y = self.within_after[k](y, after.levels[0].neighbours, r_after)
            logits.append(self.heads[k](x)[:, 0])
        share = torch.sigmoid(self.spread(x)[:, 0].float())
        return RegionPrediction(logits, NEAREST * (FARTHEST / NEAREST) ** share)

    def _inputs(self, graph: Graph, steps: StepBatch, fate: Tensor) -> Tensor:
        gripper = torch.cat([gripper_features(graph, steps), fate], dim=1)
        if not self.config.low_dimensional:
            gripper = torch.zeros_like(gripper)
        return torch.cat([graph.features, gripper], dim=1)


def gripper_features(graph: Graph, steps: StepBatch) -> Tensor:
    """(M, GRIPPER_FEATURES) each point in the gripper's frames, unchanged by any motion of the whole step.

    Position in the frames of T_i and of the gripper before, each as three bounded coordinates, distance and
    two nearnesses; the open flags before and after; how far the point is above either gripper.
    """
    columns = []
    for T in (steps.T_world_goal, steps.T_world_now):
        R, p = T[graph.cloud, :3, :3], T[graph.cloud, :3, 3]
        local = ((graph.points - p)[:, :, None] * R).sum(dim=1)
        distance = (local.square().sum(1, keepdim=True) + 1e-8).sqrt()
        bounded = local / (0.1 + distance)
        columns += [bounded, distance.log1p(), torch.exp(-distance / 0.03), torch.exp(-distance / 0.12)]
    rise = graph.points[:, 2] - steps.T_world_goal[graph.cloud, 2, 3]
    fall = graph.points[:, 2] - steps.T_world_now[graph.cloud, 2, 3]
    columns += [steps.gripper[graph.cloud], 4 * rise[:, None], 4 * fall[:, None]]
    return torch.cat(columns, dim=1)


def _cross_relations(a: Graph, b: Graph, cross: Tensor) -> Tensor:
    p, n, q, m = a.points, a.levels[0].normals, b.points, b.levels[0].normals
    return relation(p[:, None], n[:, None], q[cross], m[cross])
