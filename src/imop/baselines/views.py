"""A regressor in the manner of RVT (Goyal et al. 2023, arXiv 2306.14896).

The cloud is drawn anew from virtual views, top, front and side, without perspective. Patches of all views,
the words and the gripper attend to each other. Every view gets a heat map; the place is where the sum of the
heat maps over a grid of points, projected into the views, is greatest. Rotation (a class per Euler angle),
gripper and collisions follow from features there.

What differs: each view holds what is seen from both of its sides, so that three stand for six; and a second
look at what lies around the place, by another network of the same kind, makes up for coarse pixels (as RVT-2
does).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from imop.baselines.angles import BINS, angles_of, likeliest, rotations_of, shares_of
from imop.baselines.batch import Inputs, Targets
from imop.baselines.blocks import Block, Told, adapter_size

_CHANNELS = 14
"""Of a view: colour, place and whether there is anything, from both of its sides."""
_PLANES = ((1, 2), (0, 2), (0, 1))
"""Axes of the rows and columns of each view."""


@dataclass(frozen=True)
class ViewsConfig:
    """Sizes.

    Attributes:
        pixels: edge of a view.
        patch: edge of a patch, pixels.
        width: of the tokens.
        heads: of attention.
        apart, together: layers in which patches see their own view only, and all.
        fine: channels per pixel.
        zoom: what the second look sees, metres.
        missed: how far from the target the second look may be in training, along each axis, metres.
        sigma: spread of the heat that is learnt, pixels.
    """

    pixels: int = 64
    patch: int = 8
    width: int = 128
    heads: int = 4
    apart: int = 2
    together: int = 4
    fine: int = 8
    zoom: float = 0.3
    missed: float = 0.06
    sigma: float = 1.5


def draw(points: Tensor, colors: Tensor, size: float, pixels: int) -> Tensor:
    """Views (B, 3, 14, pixels, pixels) of the cube with edge `size` around the origin.

    Args:
        points: (B, N, 3) metres.
        colors: (B, N, 3).
        size: metres.
        pixels: edge of a view.
    """
    B, N, _ = points.shape
    cells = ((points / size + 0.5) * pixels).floor().long()
    inside = ((cells >= 0) & (cells < pixels)).all(-1)
    known = torch.cat([colors, points / size, torch.ones(B, N, 1)], -1)
    known = torch.cat([known, torch.zeros(B, 1, known.shape[-1])], 1)  # the last is nothing
    views = []
    for axis, (row, column) in enumerate(_PLANES):
        pixel = torch.where(inside, cells[..., row] * pixels + cells[..., column], pixels**2)
        order = points[..., axis].argsort(1)
        rank = torch.arange(N).expand(B, N)
        pixel = pixel.gather(1, order)
        nearest = torch.full((B, pixels**2 + 1), N).scatter_reduce(1, pixel, rank, "amin")
        farthest = torch.full((B, pixels**2 + 1), -1).scatter_reduce(1, pixel, rank, "amax")
        order = F.pad(order, (0, 1), value=N)
        sides = [
            known.gather(1, order.gather(1, hit % (N + 1))[:, :-1, None].expand(-1, -1, known.shape[-1]))
            for hit in (nearest, farthest)
        ]
        views.append(torch.cat(sides, -1).transpose(1, 2).unflatten(-1, (pixels, pixels)))
    return torch.stack(views, 1)


def heat_of(place: Tensor, size: float, pixels: int, sigma: float) -> Tensor:
    """(B, 3, pixels, pixels) heat maps of a place (B, 3), each with sum 1; sigma in pixels."""
    at = (place / size + 0.5) * pixels - 0.5
    spread = torch.exp(-((torch.arange(pixels) - at[..., None]) ** 2) / (2 * sigma**2)) + 1e-12
    maps = torch.stack([spread[:, r, :, None] * spread[:, c, None, :] for r, c in _PLANES], 1)
    return maps / maps.sum((-1, -2), keepdim=True)


def place_of(heat: Tensor, size: float) -> Tensor:
    """(B, 3) where the sum of logarithmic heat maps (B, 3, pixels, pixels) is greatest, finer than pixels.

    The points that are asked are the middles of the pixels' cubes; the mean of the best one's neighbours
    counts, each weighed by its heat.
    """
    B, _, pixels, _ = heat.shape
    x, y, z = (heat[:, view].float().flatten(1).log_softmax(-1).view(B, pixels, pixels) for view in range(3))
    total = x[:, None, :, :] + y[:, :, None, :] + z[:, :, :, None]
    best = total.flatten(1).argmax(-1)
    center = torch.stack([best // pixels**2, best // pixels % pixels, best % pixels], -1)
    near = [(c[:, None] + torch.arange(-2, 3)).clamp(0, pixels - 1) for c in center.unbind(-1)]
    i, j, k = torch.meshgrid(*(torch.arange(5) for _ in range(3)), indexing="ij")
    cells = torch.stack([near[0][:, i.flatten()], near[1][:, j.flatten()], near[2][:, k.flatten()]], -1)
    flat = (cells[..., 0] * pixels + cells[..., 1]) * pixels + cells[..., 2]
    weights = total.flatten(1).gather(1, flat).softmax(-1)
    mean = (weights[..., None] * cells.float()).sum(1)
    return ((mean + 0.5) / pixels - 0.5) * size


class Look(nn.Module):
    """Heat maps of a cube, and tokens of its patches."""

    def __init__(self, config: ViewsConfig):
        super().__init__()
        width, patch = config.width, config.patch
        self.config, self.side = config, config.pixels // patch
        self.patches = nn.Conv2d(_CHANNELS, width, patch, patch)
        self.place = nn.Parameter(torch.randn(3, self.side**2, width) * 0.02)
        self.told = Told(width)
        self.apart = nn.ModuleList(Block(width, config.heads) for _ in range(config.apart))
        self.together = nn.ModuleList(Block(width, config.heads) for _ in range(config.together))
        self.norm = nn.LayerNorm(width)
        self.pixels = nn.Conv2d(_CHANNELS, 2 * config.fine, 3, padding=1)
        self.up = nn.Linear(width, config.fine * patch**2)
        self.mix = nn.Conv2d(3 * config.fine, 2 * config.fine, 3, padding=1)
        self.heat = nn.Conv2d(2 * config.fine, 1, 1)

    def forward(
        self, views: Tensor, inputs: Inputs, origin: Tensor, adapters: Sequence[Tensor | None]
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Look at views (B, 3, 14, pixels, pixels) of a cube around `origin` (B, 3).

        Returns:
            Heat (B, 3, pixels, pixels) before the softmax, features of the pixels (B, 3, C, pixels, pixels),
            and tokens (B, 3 side^2 + told, width).
        """
        B, side, patch = len(views), self.side, self.config.patch
        images = views.flatten(0, 1)
        tokens = self.patches(images).flatten(2).transpose(1, 2).unflatten(0, (B, 3)) + self.place
        tokens = tokens.flatten(0, 1)
        for block, adapter in zip(self.apart, adapters, strict=False):
            each = None if adapter is None else adapter.expand(B, -1).repeat_interleave(3, 0)
            tokens = block(tokens, adapter=each)
        joint = torch.cat([tokens.reshape(B, 3 * side**2, -1), self.told(inputs, origin)], 1)
        for block, adapter in zip(self.together, adapters[len(self.apart) :], strict=True):
            joint = block(joint, adapter=None if adapter is None else adapter.expand(B, -1))
        joint = self.norm(joint)
        seen = self.up(joint[:, : 3 * side**2]).reshape(B * 3, side, side, -1, patch, patch)
        seen = seen.permute(0, 3, 1, 4, 2, 5).flatten(4, 5).flatten(2, 3)
        features = F.gelu(self.mix(torch.cat([seen, F.gelu(self.pixels(images))], 1)))
        heat = self.heat(features).reshape(B, 3, self.config.pixels, self.config.pixels)
        return heat, features.unflatten(0, (B, 3)), joint


class ViewsNetwork(nn.Module):
    """Two looks, the second one nearer, and what the gripper does there."""

    def __init__(self, config: ViewsConfig):
        super().__init__()
        self.config = config
        self.far, self.near = Look(config), Look(config)
        pooled = 3 * (config.width + 2 * config.fine) + 2 * config.width
        self.act = nn.Sequential(nn.Linear(pooled, 256), nn.GELU(), nn.Linear(256, 3 * BINS + 2))

    @property
    def adapters(self) -> tuple[int, int]:
        """How many adapters there can be, and how many numbers each has."""
        return 2 * (self.config.apart + self.config.together), adapter_size(self.config.width)

    def loss(self, inputs: Inputs, targets: Targets, adapters: Tensor | None = None) -> dict[str, Tensor]:
        """Cross-entropies of heat maps, angles, gripper and collisions; adapters as in `predict`."""
        c, p = self.config, targets.pose[:, :3, 3]
        first, second = self._split(adapters)
        heat, _, _ = self._look(self.far, inputs, torch.zeros_like(p), 1.0, first)
        origin = p + (torch.rand_like(p) * 2 - 1) * c.missed
        near, features, tokens = self._look(self.near, inputs, origin, c.zoom, second)
        label = heat_of(p - origin, c.zoom, c.pixels, c.sigma)
        angles, opened, collides = self._act(label, features, tokens)
        shares = shares_of(angles_of(targets.pose[:, :3, :3]))
        return {
            "far": _cross_entropy(heat, heat_of(p, 1.0, c.pixels, c.sigma)),
            "near": _cross_entropy(near, label),
            "rotation": -(angles.float().log_softmax(-1) * shares).sum(-1).mean(),
            "gripper": F.binary_cross_entropy_with_logits(opened, targets.gripper_open),
            "collisions": F.binary_cross_entropy_with_logits(collides, targets.allow_collisions),
        }

    @torch.no_grad()
    def predict(self, inputs: Inputs, adapters: Tensor | None = None) -> Targets:
        """The actions in B states.

        Args:
            inputs: the states.
            adapters: (B or 1, blocks, adapter size) weights of adapters; none if None.
        """
        first, second = self._split(adapters)
        heat, _, _ = self._look(self.far, inputs, torch.zeros(len(inputs.points), 3), 1.0, first)
        origin = place_of(heat, 1.0)
        near, features, tokens = self._look(self.near, inputs, origin, self.config.zoom, second)
        angles, opened, collides = self._act(
            near.float().flatten(2).softmax(-1).view_as(near), features, tokens
        )
        pose = torch.eye(4).repeat(len(origin), 1, 1)
        pose[:, :3, :3] = rotations_of(likeliest(angles.float()))
        pose[:, :3, 3] = origin + place_of(near, self.config.zoom)
        return Targets(pose, (opened > 0).float(), (collides > 0).float())

    @torch.no_grad()
    def describe(self, inputs: Inputs) -> Tensor:
        """(B, 2 width) what the first look holds of B states, for those who tell tasks apart."""
        _, _, tokens = self._look(
            self.far, inputs, torch.zeros(len(inputs.points), 3), 1.0, self._split(None)[0]
        )
        return torch.cat([tokens.mean(1), tokens[:, 3 * self.far.side**2]], -1).float()

    def _look(
        self, look: Look, inputs: Inputs, origin: Tensor, size: float, adapters: Sequence[Tensor | None]
    ) -> tuple[Tensor, Tensor, Tensor]:
        views = draw(inputs.points - origin[:, None], inputs.colors, size, self.config.pixels)
        heat, features, tokens = look(views, inputs, origin, adapters)
        return heat, features, tokens

    def _split(self, adapters: Tensor | None) -> tuple[Sequence[Tensor | None], Sequence[Tensor | None]]:
        half = self.adapters[0] // 2
        each: Sequence[Tensor | None] = [None] * 2 * half if adapters is None else adapters.unbind(1)
        return each[:half], each[half:]

    def _act(self, heat: Tensor, features: Tensor, tokens: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Scores of angles (B, 3, BINS), opening (B,) and collisions (B,), from where the heat (sum 1) is."""
        side, patch = self.near.side, self.config.patch
        B = len(heat)
        by_patch = heat.unflatten(-1, (side, patch)).unflatten(2, (side, patch)).sum((3, 5)).flatten(2)
        seen = tokens[:, : 3 * side**2].unflatten(1, (3, side**2))
        there = torch.einsum("bvp,bvpc->bvc", by_patch, seen.float())
        fine = torch.einsum("bvij,bvcij->bvc", heat, features.float())
        most, gripper = tokens[:, : 3 * side**2].amax(1), tokens[:, 3 * side**2]
        scores = self.act(torch.cat([there.flatten(1), fine.flatten(1), most, gripper], -1)).float()
        return scores[:, : 3 * BINS].view(B, 3, BINS), scores[:, -2], scores[:, -1]


def _cross_entropy(heat: Tensor, label: Tensor) -> Tensor:
    return -(heat.float().flatten(2).log_softmax(-1) * label.flatten(2)).sum(-1).mean()
