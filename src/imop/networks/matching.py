"""The matching network: which point of a new state is which point of the invariant region?

Paper, section III-C1: cross attention between the region's graph and the query's, dual softmax. After every
layer the region is carried to where most matches so far say it is (the repositioning of Lepard, Li and
Harada, CVPR 2022), so that the next layer may look at who is near.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import torch
from torch import Tensor, nn

from imop.geometry.procrustes import robust_procrustes
from imop.networks.backbone import Backbone, BackboneConfig, level_relations
from imop.networks.blocks import MLP, RELATION, UNIT, DenseBlock, GraphBlock, exact, gather, pad, relation
from imop.networks.graph import Graph
from imop.networks.region import GRIPPER_FEATURES, StepBatch

# Query points per region point that a motion is fitted to.
LIKELIEST = 3
# Distances (metres) up to which matches count, one fit after the other.
REACHES = (0.3, 0.2, 0.13, 0.09, 0.06, 0.04, 0.028, 0.02)


@dataclass(frozen=True)
class MatchingConfig:
    """Shape of the matching network.

    Attributes:
        backbone: shared by the support and the query state.
        layers: rounds of attention, each with a correspondence matrix.
        attention: "global" attends from every region point to every query point; "graph" to the `neighbours`
            most alike at first, and nearest once the region was carried over.
        neighbours: K of the cross graph.
        heads: of the dense attention.
        max_region: points of the region that are matched.
        region_first: False matches points of the whole support state instead of its region's.
        low_dimensional: whether the region's points are seen from the gripper, too (the paper's ablation).
    """

    backbone: BackboneConfig = field(default_factory=BackboneConfig)
    layers: int = 3
    attention: Literal["graph", "global"] = "global"
    neighbours: int = 8
    heads: int = 4
    max_region: int = 160
    region_first: bool = True
    low_dimensional: bool = True


@dataclass(frozen=True, eq=False)
class Correspondence:
    """Correspondence matrices of a batch, padded.

    Attributes:
        layers: (B, R, Q) confidence in [0, 1] after each layer: softmax over rows times softmax over columns.
        p_region: (B, R, 3) metres, world frame of the demonstration.
        p_query: (B, Q, 3) metres, world frame of the query.
        region: (B, R) True where there is a region point.
        query: (B, Q) True where there is a query point.
    """

    layers: list[Tensor]
    p_region: Tensor
    p_query: Tensor
    region: Tensor
    query: Tensor

    @property
    def last(self) -> Tensor:
        """(B, R, Q) the matrix of the last layer."""
        return self.layers[-1]


@dataclass(frozen=True, eq=False)
class Described:
    """A batch of regions, with what the network thinks of them before it sees a query.

    Attributes:
        x: (B, R, C) padded features after the first round of self attention.
        p: (B, R, 3) metres, world frame of the demonstration.
        n: (B, R, 3) unit normals.
        present: (B, R) True where there is a point.
        bias: of each layer's self attention, (B, heads, R, R).
    """

    x: Tensor
    p: Tensor
    n: Tensor
    present: Tensor
    bias: list[Tensor]


class MatchingNetwork(nn.Module):
    """Demonstrated step with a region, and a query state -> correspondence matrices."""

    def __init__(self, config: MatchingConfig):
        super().__init__()
        self.config = config
        self.backbone = Backbone(config.backbone)
        width = config.backbone.widths[0]
        groups = width // config.backbone.group_width
        self.action = nn.Linear(GRIPPER_FEATURES, width) if config.low_dimensional else None

        def each(make: Callable[..., nn.Module], *arguments: int) -> nn.ModuleList:
            return nn.ModuleList(make(*arguments) for _ in range(config.layers))

        self.region_self = each(DenseBlock, width, config.heads)
        self.region_bias = each(MLP, RELATION, 16, config.heads)
        self.query_self = each(GraphBlock, width, groups)
        if config.attention == "global":
            self.region_cross = each(DenseBlock, width, config.heads, True)
            self.query_cross = each(DenseBlock, width, config.heads, True)
            self.near_bias = nn.ModuleList(nn.Linear(3, config.heads) for _ in range(config.layers - 1))
        else:
            self.region_cross = each(GraphBlock, width, groups, True)
            self.query_cross = each(GraphBlock, width, groups, True)
        self.project = each(nn.Linear, width, width)
        self.log_scale = nn.Parameter(torch.full((config.layers,), 1.0))

    def describe(self, steps: StepBatch, region: Tensor, features: Tensor | None = None) -> Described:
        """All about regions that does not depend on the query; it may be kept for many queries.

        Args:
            steps: the demonstrated steps, of which s_i' is not read.
            region: (R,) indices of the region's points in s_i, cloud after cloud, at least one in each.
            features: (M, C) `backbone(steps.before)`, if it was computed before.
        """
        support = steps.before
        cloud, size = support.cloud[region], support.size
        features = self.backbone(support) if features is None else features
        described = gather(features, region)
        if self.action is not None:
            described = described + self.action(steps.features[region])
        x, present = pad(described, cloud, size)
        p, _ = pad(support.points[region], cloud, size)
        n, _ = pad(support.levels[0].normals[region], cloud, size)
        own = relation(p[:, :, None], n[:, :, None], p[:, None], n[:, None])
        bias = [_masked(bias(own).permute(0, 3, 1, 2), present) for bias in self.region_bias]
        return Described(self.region_self[0](x, bias[0]), p, n, present, bias)

    def forward(self, steps: StepBatch, region: Tensor, query: Graph) -> Correspondence:
        """Match the regions of a batch of steps to as many queries s_j; see `describe`."""
        return self.match(self.describe(steps, region), query)

    def match(self, region: Described, query: Graph) -> Correspondence:
        """Match regions to a batch of as many queries s_j."""
        x, size = region.x, query.size
        y = self.backbone(query)
        p_y, query_present = pad(query.points, query.cloud, size)
        n_y, _ = pad(query.levels[0].normals, query.cloud, size)
        sides = _Sides(region.p, region.n, region.present, p_y, n_y, query_present)
        r_query = level_relations(query.levels[0])

        matrices: list[Tensor] = []
        T: Tensor | None = None
        for k in range(self.config.layers):
            if k:
                x = self.region_self[k](x, region.bias[k])
            y = self.query_self[k](y, query.levels[0].neighbours, r_query)
            y_padded, _ = pad(y, query.cloud, size)
            cross = self._dense if self.config.attention == "global" else self._graph
            x, y_padded = cross(k, x, y_padded, sides, T)
            y = y_padded[query_present]
            matrices.append(self._match(k, x, y_padded, sides))
            if k + 1 < self.config.layers:
                T = reposition(matrices[-1], sides.p_x, sides.p_y)
        return Correspondence(matrices, region.p, p_y, region.present, query_present)

    def _match(self, k: int, x: Tensor, y: Tensor, sides: "_Sides") -> Tensor:
        a, b = self.project[k](x).float(), self.project[k](y).float()
        with exact(a):
            scores = a @ b.mT * (self.log_scale[k].exp() / a.shape[-1] ** 0.5)
            return dual_softmax(scores, sides.x, sides.y)

    def _dense(
        self, k: int, x: Tensor, y: Tensor, sides: "_Sides", T: Tensor | None
    ) -> tuple[Tensor, Tensor]:
        if T is None:
            to_y = sides.y[:, None].expand(-1, x.shape[1], -1)
            to_x = sides.x[:, None].expand(-1, y.shape[1], -1)
        else:
            distance = torch.cdist(_moved(T, sides.p_x), sides.p_y) / UNIT
            near = torch.stack([distance.log1p(), torch.exp(-distance), torch.exp(-distance / 4)], dim=1)
            # A linear layer over dimension 1: the attention wants its heads there.
            linear = self.near_bias[k - 1]
            assert isinstance(linear, nn.Linear)
            bias = (linear.weight @ near.flatten(2) + linear.bias[:, None]).reshape(
                len(T), -1, *near.shape[2:]
            )
            to_y, to_x = _masked(bias, sides.y), _masked(bias.mT, sides.x)
        return self.region_cross[k](x, to_y, y), self.query_cross[k](y, to_x, x)

    def _graph(
        self, k: int, x: Tensor, y: Tensor, sides: "_Sides", T: Tensor | None
    ) -> tuple[Tensor, Tensor]:
        """Cross attention over neighbours: alike before the region was carried over, near afterwards."""
        if T is None:
            distance = -nn.functional.normalize(x, dim=-1) @ nn.functional.normalize(y, dim=-1).mT
            p_x, n_x = sides.p_x, sides.n_x
        else:
            p_x, n_x = _moved(T, sides.p_x), sides.n_x @ T[:, :3, :3].mT
            distance = torch.cdist(p_x, sides.p_y)
        distance = distance.detach()
        to_y = _nearest(distance.masked_fill(~sides.y[:, None], torch.inf), self.config.neighbours)
        to_x = _nearest(distance.mT.masked_fill(~sides.x[:, None], torch.inf), self.config.neighbours)
        known = 0.0 if T is None else 1.0
        r_y = known * _gathered_relation(p_x, n_x, sides.p_y, sides.n_y, to_y)
        r_x = known * _gathered_relation(sides.p_y, sides.n_y, p_x, n_x, to_x)
        moved_x = self.region_cross[k](x.flatten(0, 1), _flat(to_y, y.shape[1]), r_y, y.flatten(0, 1))
        moved_y = self.query_cross[k](y.flatten(0, 1), _flat(to_x, x.shape[1]), r_x, x.flatten(0, 1))
        return moved_x.view_as(x), moved_y.view_as(y)


@dataclass(frozen=True, eq=False)
class _Sides:
    """Padded points, normals and presence of the region (x) and of the query (y)."""

    p_x: Tensor
    n_x: Tensor
    x: Tensor
    p_y: Tensor
    n_y: Tensor
    y: Tensor


def dual_softmax(scores: Tensor, rows: Tensor, columns: Tensor) -> Tensor:
    """(B, R, Q) product of the softmaxes over columns and over rows; 0 where a point is missing.

    Args:
        scores: (B, R, Q).
        rows: (B, R) True where there is a point.
        columns: (B, Q) likewise.
    """
    # A large negative number, not infinity: a row without any point must not become NaN.
    over_columns = scores.masked_fill(~columns[:, None], -1e9).softmax(dim=2)
    over_rows = scores.masked_fill(~rows[:, :, None], -1e9).softmax(dim=1)
    return over_columns * over_rows * (rows[:, :, None] & columns[:, None])


def reposition(matrix: Tensor, p_x: Tensor, p_y: Tensor, trust: Tensor | None = None) -> Tensor:
    """(B, 4, 4) motion of the region that most of the likeliest matches agree on; no gradient.

    Least squares as in the paper, reweighted while the reach within which matches still count shrinks: many
    matches are of equal parts or of the wrong side, and their average would be nowhere.

    Args:
        matrix: (B, R, Q) confidence of each pair.
        p_x: (B, R, 3) region.
        p_y: (B, Q, 3) query.
        trust: (B, R) how much the matches of each region point count; all the same if None.
    """
    with torch.no_grad(), exact(p_x):
        weight, best = matrix.to(p_x.dtype).topk(min(LIKELIEST, matrix.shape[2]), dim=2)
        y = torch.gather(p_y, 1, best.flatten(1)[..., None].expand(-1, -1, 3))
        x = p_x.repeat_interleave(weight.shape[2], dim=1)
        if trust is not None:
            weight = weight * trust[..., None].to(weight)
        return robust_procrustes(x, y, weight.flatten(1), REACHES)


def _moved(T: Tensor, p: Tensor) -> Tensor:
    with exact(p):
        return p @ T[:, :3, :3].mT + T[:, None, :3, 3]


def _masked(bias: Tensor, present: Tensor) -> Tensor:
    """(B, H, M, N) bias with absent columns (B, N) shut out."""
    return bias if present.all() else bias.masked_fill(~present[:, None, None], -1e9)


def _nearest(distance: Tensor, k: int) -> Tensor:
    return distance.topk(min(k, distance.shape[-1]), dim=-1, largest=False).indices


def _flat(index: Tensor, length: int) -> Tensor:
    """(B, M, K) indices within clouds -> (B M, K) indices into the flattened batch."""
    first = torch.arange(len(index), device=index.device) * length
    return (index + first[:, None, None]).flatten(0, 1)


def _gathered_relation(p: Tensor, n: Tensor, q: Tensor, m: Tensor, index: Tensor) -> Tensor:
    """(B M, K, RELATION) of points p to their chosen counterparts in q."""
    flat = _flat(index, q.shape[1])
    found = relation(
        p.flatten(0, 1)[:, None], n.flatten(0, 1)[:, None], q.flatten(0, 1)[flat], m.flatten(0, 1)[flat]
    )
    return found
