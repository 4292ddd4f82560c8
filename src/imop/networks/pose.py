"""Regressed poses, which the paper compares with its least squares (the table of ablations, "Regression").

The least-squares pose has no parameters and needs nothing from here: see `matching.reposition`.
"""

from dataclasses import dataclass, field
from typing import Literal

import roma
import torch
from torch import Tensor, nn

from imop.networks.backbone import Backbone, BackboneConfig
from imop.networks.blocks import MLP, UNIT, DenseBlock, exact, pad, pool_mean
from imop.networks.graph import Graph
from imop.networks.matching import Correspondence
from imop.networks.region import GRIPPER_FEATURES, StepBatch, gripper_features

_SCENE = 0.2
"""Places in a scene are measured in this unit, metres, before they enter a network."""


@dataclass(frozen=True)
class PoseConfig:
    """How the pose of the gripper in the query is found.

    Attributes:
        method: "analytic" by least squares over the matches; "from_matches" by a network that sees the
            matched points; "regressed" by a network that sees both states and no matches.
        width: of the network that sees matched points.
        backbone: of the network that sees both states, which it shares.
        layers: rounds of attention of that network.
        heads: of the attention.
    """

    method: Literal["analytic", "from_matches", "regressed"] = "analytic"
    width: int = 96
    backbone: BackboneConfig = field(default_factory=BackboneConfig)
    layers: int = 2
    heads: int = 4


class MatchedPose(nn.Module):
    """Correspondence matrix -> pose of the gripper in the query, by layers instead of by least squares.

    The region is seen from the demonstrated gripper and its counterpart from its own centroid, so moves of
    the demonstration and translations of the query change nothing. How the query is turned must be learned.
    """

    def __init__(self, width: int):
        super().__init__()
        self.point = MLP(7, width, width)
        self.head = MLP(2 * width, width, 9)

    def forward(self, found: Correspondence, T_world_goal: Tensor) -> Tensor:
        """Predict.

        Args:
            found: of a batch.
            T_world_goal: (B, 4, 4) the demonstrated pose T_i.

        Returns:
            (B, 4, 4) T_j, world frame of the query.
        """
        with exact(found.last):
            confidence = found.last.float().sum(dim=2)
            matched = found.last.float() @ found.p_query / confidence.clamp_min(1e-6)[..., None]
            weight = confidence / confidence.sum(dim=1, keepdim=True).clamp_min(1e-6)
            center = (weight[..., None] * matched).sum(dim=1)
            local = (found.p_region - T_world_goal[:, None, :3, 3]) @ T_world_goal[:, :3, :3]
            sides = torch.cat([local / UNIT, (matched - center[:, None]) / UNIT], dim=-1)
        points = self.point(torch.cat([sides, confidence[..., None]], dim=-1))
        largest = points.masked_fill(~found.region[..., None], -torch.inf).amax(dim=1)
        mean = (weight[..., None] * points).sum(dim=1)
        numbers = self.head(torch.cat([mean, largest], dim=1)).float()
        return _pose(numbers[:, :6], center + UNIT * numbers[:, 6:])


class RegressedPose(nn.Module):
    """Demonstrated state, its pose, and a query -> pose of the gripper in the query, without matches.

    Every point of the query, having looked at the demonstrated state, votes for a place beside itself.
    Places in the query are measured from its centroid, so translations change nothing.
    """

    def __init__(self, config: PoseConfig):
        super().__init__()
        width = config.backbone.widths[0]
        self.backbone = Backbone(config.backbone)
        self.support = nn.Linear(width + GRIPPER_FEATURES, width)
        self.query = nn.Linear(width + 3, width)
        self.across = nn.ModuleList(DenseBlock(width, config.heads, True) for _ in range(config.layers))
        self.within = nn.ModuleList(DenseBlock(width, config.heads) for _ in range(config.layers))
        self.vote = MLP(width, width, 4)
        self.turn = MLP(width, width, 6)

    def forward(self, steps: StepBatch, query: Graph) -> Tensor:
        """Predict.

        Args:
            steps: the demonstrated steps, of which s_i' is not read.
            query: s_j, as many clouds.

        Returns:
            (B, 4, 4) T_j, world frame of the query.
        """
        before, size = steps.before, query.size
        seen = self.support(torch.cat([self.backbone(before), gripper_features(before, steps)], dim=1))
        x, x_present = pad(seen, before.cloud, size)
        place = query.points - pool_mean(query.points, query.cloud, size)[query.cloud]
        asking = self.query(torch.cat([self.backbone(query), place / _SCENE], dim=1))
        y, y_present = pad(asking, query.cloud, size)
        p_y, _ = pad(query.points, query.cloud, size)
        to_x = x_present[:, None].expand(-1, y.shape[1], -1)
        to_y = y_present[:, None].expand(-1, y.shape[1], -1)
        for across, within in zip(self.across, self.within, strict=True):
            y = within(across(y, to_x, x), to_y)
        votes = self.vote(y).float()
        with exact(y):
            share = votes[..., 0].masked_fill(~y_present, -1e9).softmax(dim=1)[..., None]
            p = (share * (p_y + UNIT * votes[..., 1:])).sum(dim=1)
            token = (share * y.float()).sum(dim=1)
        return _pose(self.turn(token).float(), p)


def pose_network(config: PoseConfig) -> MatchedPose | RegressedPose | None:
    """What `config.method` needs; None for least squares."""
    if config.method == "analytic":
        return None
    return MatchedPose(config.width) if config.method == "from_matches" else RegressedPose(config)


def _pose(columns: Tensor, p: Tensor) -> Tensor:
    """(B, 4, 4) from two columns (B, 6) that are made orthonormal, and a place (B, 3).

    Source: Zhou et al., On the continuity of rotation representations in neural networks, CVPR 2019.
    """
    # Without a bias towards some rotation, columns near zero would make the turn jump.
    upright = torch.tensor([1.0, 0.0, 0.0, 0.0, 1.0, 0.0]).to(columns)
    R = roma.special_gramschmidt((columns + upright).view(-1, 2, 3).mT)
    T = torch.eye(4).to(p).repeat(len(p), 1, 1)
    T[:, :3, :3], T[:, :3, 3] = R, p
    return T
