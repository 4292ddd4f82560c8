"""Pieces that the networks share: attention over neighbours, dense attention, pooling along an index.

Positions enter only as differences, described so that moves along the table and turns about the vertical
change nothing: length, rise, and the angles between the normals and the connecting line.
"""

import torch
from torch import Tensor, nn
from torch.nn import functional as F

RELATION = 8
# Lengths are measured in this unit, metres, before they enter a network.
UNIT = 0.05


def relation(p_i: Tensor, n_i: Tensor, p_j: Tensor, n_j: Tensor) -> Tensor:
    """(..., RELATION) what is known of point j as seen from point i, unchanged by yaw and translation.

    The last two, triple products with the vertical, change their signs in a mirror.

    Args:
        p_i: (..., 3) metres.
        n_i: (..., 3) unit normals.
        p_j: (..., 3).
        n_j: (..., 3).
    """
    offset = (p_j - p_i) / UNIT
    length = (offset.square().sum(-1) + 1e-8).sqrt()
    direction = offset / length[..., None]
    return torch.stack(
        [
            torch.log1p(length),
            torch.exp(-length),
            offset[..., 2] / (1 + length),
            (n_i * direction).sum(-1),
            (n_j * direction).sum(-1),
            (n_i * n_j).sum(-1),
            n_i[..., 0] * direction[..., 1] - n_i[..., 1] * direction[..., 0],
            n_j[..., 0] * direction[..., 1] - n_j[..., 1] * direction[..., 0],
        ],
        dim=-1,
    )


class MLP(nn.Sequential):
    """Linear, SiLU, linear."""

    def __init__(self, inputs: int, hidden: int, outputs: int):
        super().__init__(nn.Linear(inputs, hidden), nn.SiLU(), nn.Linear(hidden, outputs))


class Standardized(nn.Module):
    """Inputs (N, C) to mean 0 and variance 1 over all states of the training so far, cut off far outside.

    Unlike batch norm it treats demonstrated states and queries, training and use, alike.
    """

    mean: Tensor
    square: Tensor
    batches: Tensor

    def __init__(self, width: int):
        super().__init__()
        self.register_buffer("mean", torch.zeros(width))
        self.register_buffer("square", torch.ones(width))
        self.register_buffer("batches", torch.zeros(()))

    def forward(self, x: Tensor) -> Tensor:
        """The standardized inputs; in training they are taken note of first."""
        if self.training:
            with torch.no_grad():
                self.batches += 1
                share = 1 / self.batches.clamp(max=1000.0)
                self.mean.lerp_(x.mean(dim=0), share)
                self.square.lerp_(x.square().mean(dim=0), share)
        spread = (self.square - self.mean.square()).clamp_min(0).sqrt() + 0.02
        return ((x - self.mean) / spread).clamp(-4, 4)


def exact(x: Tensor) -> torch.autocast:
    """A context without mixed precision: places and scores need more than eight bits."""
    return torch.autocast(x.device.type, enabled=False)


def gather(x: Tensor, index: Tensor) -> Tensor:
    """x[index] for x (N, C) and index of any shape; on a CPU four times as fast as indexing."""
    return x.index_select(0, index.reshape(-1)).view(*index.shape, x.shape[1])


class GroupedVectorAttention(nn.Module):
    """Point Transformer V2's attention over neighbours: one weight per group of channels.

    weights = softmax over neighbours of MLP((k_j - q_i) * m(r_ij) + b(r_ij)); values = v_j + b(r_ij), where
    r_ij is the relation of the pair.

    Source: Wu et al., Point Transformer V2, NeurIPS 2022, section 3.
    """

    def __init__(self, width: int, groups: int):
        super().__init__()
        self.query = nn.Sequential(nn.Linear(width, width), nn.LayerNorm(width), nn.ReLU())
        self.key = nn.Sequential(nn.Linear(width, width), nn.LayerNorm(width), nn.ReLU())
        self.value = nn.Linear(width, width)
        self.position = MLP(RELATION, max(16, width // 4), 2 * width)
        self.weight = MLP(width, groups, groups)
        self.out = nn.Linear(width, width)
        spread = torch.eye(groups).repeat_interleave(width // groups, dim=1)
        self.register_buffer("spread", spread, persistent=False)

    def forward(self, x: Tensor, context: Tensor, neighbours: Tensor, relations: Tensor) -> Tensor:
        """Attend from each point to its neighbours.

        Args:
            x: (M, C) features that ask.
            context: (N, C) features that answer; `x` itself for self attention.
            neighbours: (M, K) indices into `context`.
            relations: (M, K, RELATION) of the pairs.

        Returns:
            (M, C).
        """
        scale, shift = self.position(relations).chunk(2, dim=-1)
        key = gather(self.key(context), neighbours)
        logits = self.weight((key - self.query(x)[:, None]) * scale + shift)
        # A product with 0 and 1 spreads the groups over their channels; broadcasting is far slower.
        weights = logits.softmax(dim=1) @ self.spread
        values = gather(self.value(context), neighbours) + shift
        mixed: Tensor = self.out((weights * values).sum(dim=1))
        return mixed


class GraphBlock(nn.Module):
    """Residual attention over neighbours, within a cloud or across to another; then a residual MLP."""

    def __init__(self, width: int, groups: int, cross: bool = False):
        super().__init__()
        self.norm_x = nn.LayerNorm(width)
        self.norm_context = nn.LayerNorm(width) if cross else None
        self.attention = GroupedVectorAttention(width, groups)
        self.mlp = nn.Sequential(nn.LayerNorm(width), MLP(width, 2 * width, width))

    def forward(
        self, x: Tensor, neighbours: Tensor, relations: Tensor, context: Tensor | None = None
    ) -> Tensor:
        """Features (M, C) after attending to `context` (N, C) if `cross`, else to themselves."""
        asked = self.norm_x(x)
        answering = asked if self.norm_context is None else self.norm_context(context)
        x = x + self.attention(asked, answering, neighbours, relations)
        moved: Tensor = x + self.mlp(x)
        return moved


class GraphBlocks(nn.Module):
    """Several graph blocks in a row."""

    def __init__(self, width: int, groups: int, depth: int):
        super().__init__()
        self.blocks = nn.ModuleList(GraphBlock(width, groups) for _ in range(depth))

    def forward(self, x: Tensor, neighbours: Tensor, relations: Tensor) -> Tensor:
        """Features (M, C) after every block; see `GraphBlock`."""
        for block in self.blocks:
            x = block(x, neighbours, relations)
        return x


class DenseBlock(nn.Module):
    """Residual multi-head attention over whole clouds, within or across; then a residual MLP."""

    def __init__(self, width: int, heads: int, cross: bool = False):
        super().__init__()
        self.norm_x = nn.LayerNorm(width)
        self.norm_context = nn.LayerNorm(width) if cross else None
        self.query = nn.Linear(width, width)
        self.key_value = nn.Linear(width, 2 * width)
        self.out = nn.Linear(width, width)
        self.mlp = nn.Sequential(nn.LayerNorm(width), MLP(width, 2 * width, width))
        self.heads = heads

    def forward(self, x: Tensor, mask: Tensor, context: Tensor | None = None) -> Tensor:
        """Attend from `x` to `context`, or within `x`.

        Args:
            x: (B, M, C) padded features.
            mask: (B, M, N) True where a pair may attend, or (B, heads, M, N) float added to the scores.
            context: (B, N, C) if `cross`, else None.

        Returns:
            (B, M, C).
        """
        asked = self.norm_x(x)
        answering = asked if self.norm_context is None else self.norm_context(context)
        if mask.ndim == 3:
            mask = mask[:, None]
        key, value = self.key_value(answering).chunk(2, dim=-1)
        asking, key, value = (_split(t, self.heads) for t in (self.query(asked), key, value))
        mixed = F.scaled_dot_product_attention(asking, key, value, attn_mask=mask)
        x = x + self.out(mixed.transpose(1, 2).flatten(2))
        moved: Tensor = x + self.mlp(x)
        return moved


def _split(x: Tensor, heads: int) -> Tensor:
    return x.view(*x.shape[:-1], heads, -1).transpose(1, 2)


def pool_max(x: Tensor, parent: Tensor, cells: int) -> Tensor:
    """(cells, C) largest features of the points (M, C) of each cell."""
    index = parent[:, None].expand_as(x)
    return x.new_zeros(cells, x.shape[1]).scatter_reduce(0, index, x, "amax", include_self=False)


def pool_mean(x: Tensor, parent: Tensor, cells: int) -> Tensor:
    """(cells, C) mean features of the points (M, C) of each cell; 0 for cells without points."""
    total = x.new_zeros(cells, x.shape[1]).index_add(0, parent, x)
    count = x.new_zeros(cells).index_add(0, parent, torch.ones_like(x[:, 0]))
    return total / count.clamp_min(1)[:, None]


def pad(x: Tensor, cloud: Tensor, size: int) -> tuple[Tensor, Tensor]:
    """Ragged to padded: (B, L, C) with zeros, and (B, L) True where there is a point.

    Args:
        x: (M, C), clouds one after the other.
        cloud: (M,) number of the cloud, not decreasing.
        size: number of clouds B.
    """
    counts = torch.bincount(cloud, minlength=size)
    length = int(counts.max()) if len(counts) else 0
    start = counts.cumsum(0) - counts
    place = torch.arange(len(x), device=x.device) - start[cloud]
    padded = x.new_zeros(size, length, x.shape[-1])
    padded[cloud, place] = x
    present = torch.arange(length, device=x.device) < counts[:, None]
    return padded, present
