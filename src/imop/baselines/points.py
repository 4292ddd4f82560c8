"""A regressor in the manner of Act3D (Gervet et al. 2023, arXiv 2306.17817).

Ghost points are sampled in space, all over the workspace first, then twice more around the best one. Each
attends to features of the scene, by relative positions (rotary), and is scored against the token of the
gripper, which has attended to the words and the scene. The best of the last is the place; rotation, gripper
and collisions follow from its feature.

What differs: features of the scene come from groups of points of the cloud instead of pretrained images'.
"""

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from imop.baselines.batch import Inputs, Targets
from imop.baselines.blocks import Block, Rotary, Told


@dataclass(frozen=True)
class PointsConfig:
    """Sizes.

    Attributes:
        width: of the tokens; heads times a multiple of 6.
        heads: of attention.
        layers: of attention within the scene.
        asking: layers in which ghost points attend to the scene, the same in all stages.
        groups: points of a coarse and of a fine token.
        near: coarse and fine tokens that ghost points attend to after the first stage.
        ghosts: of a stage, in training.
        tried: of a stage, when acting.
        radii: of the balls in which the second and third stage sample, metres.
        sigmas: how near to the target is as good, in each stage, metres.
        blurred: what lies so near to the best ghost point of the last stage is averaged with it, metres.
    """

    width: int = 96
    heads: int = 2
    layers: int = 3
    asking: int = 2
    groups: tuple[int, int] = (16, 2)
    near: tuple[int, int] = (64, 128)
    ghosts: int = 192
    tried: int = 1024
    radii: tuple[float, float] = (0.16, 0.04)
    sigmas: tuple[float, float, float] = (0.05, 0.02, 0.006)
    blurred: float = 0.012


class Grouped(nn.Module):
    """Tokens of groups of successive points, which lie together."""

    def __init__(self, width: int, scale: float):
        super().__init__()
        self.scale = scale
        self.point = nn.Sequential(nn.Linear(9, width), nn.GELU(), nn.Linear(width, width))
        self.out = nn.Linear(width, width)

    def forward(self, points: Tensor, colors: Tensor) -> Tensor:
        """(B, G, width) of points and colours (B, G, K, 3)."""
        relative = (points - points.mean(2, keepdim=True)) / self.scale
        x: Tensor = self.point(torch.cat([relative, colors, points * 2], -1))
        return self.out(F.gelu(x.amax(2)))  # type: ignore[no-any-return]


class PointsNetwork(nn.Module):
    """Coarse to fine over ghost points."""

    def __init__(self, config: PointsConfig):
        super().__init__()
        self.config = config
        width = config.width
        self.rotary = Rotary(width // config.heads)
        self.coarse, self.fine = Grouped(width, 0.02), Grouped(width, 0.01)
        self.told = Told(width)
        self.ghost = nn.Parameter(torch.randn(width) * 0.3)
        self.scene = nn.ModuleList(Block(width, config.heads) for _ in range(config.layers))
        self.asking = nn.ModuleList(Block(width, config.heads) for _ in range(config.asking))
        self.norm = nn.LayerNorm(width)
        self.score = nn.ModuleList(nn.Linear(width, width) for _ in range(3))
        self.act = nn.Sequential(nn.Linear(2 * width, 256), nn.GELU(), nn.Linear(256, 8))

    def loss(self, inputs: Inputs, targets: Targets) -> dict[str, Tensor]:
        """Cross-entropies of ghost points, gripper and collisions, and the squared error of the rotation."""
        c, p = self.config, targets.pose[:, :3, 3]
        scene = self._see(inputs)
        found, parts = p, {}
        for stage, sigma in enumerate(c.sigmas):
            ghosts = sample_ghosts(p, stage, c, c.ghosts, miss=True)
            features = self._ask(scene, torch.cat([ghosts, found[:, None]], 1), stage, p)
            scores = self._scores(scene, features[:, :-1], stage)
            distance = (ghosts - p[:, None]).square().sum(-1)
            label = (-distance / (2 * sigma**2)).softmax(-1)
            parts[f"stage_{stage}"] = -(scores.log_softmax(-1) * label).sum(-1).mean()
        columns, opened, collides = self._act(scene, features[:, -1])
        wanted = targets.pose[:, :3, :2].transpose(1, 2)
        parts["rotation"] = 3 * (columns - wanted).square().sum((1, 2)).mean()
        parts["gripper"] = F.binary_cross_entropy_with_logits(opened, targets.gripper_open)
        parts["collisions"] = F.binary_cross_entropy_with_logits(collides, targets.allow_collisions)
        return parts

    @torch.no_grad()
    def predict(self, inputs: Inputs) -> Targets:
        """The actions in B states."""
        scene = self._see(inputs)
        place = torch.zeros(len(inputs.points), 3)
        for stage in range(3):
            ghosts = sample_ghosts(place, stage, self.config, self.config.tried)
            scores = self._scores(scene, self._ask(scene, ghosts, stage, place), stage)
            best = ghosts[torch.arange(len(place)), scores.argmax(-1)]
            if stage == 2:
                far = (ghosts - best[:, None]).norm(dim=-1) > self.config.blurred
                weights = scores.masked_fill(far, -torch.inf).softmax(-1)
                best = (weights[..., None] * ghosts).sum(1)
            place = best
        columns, opened, collides = self._act(scene, self._ask(scene, place[:, None], 2, place)[:, 0])
        pose = torch.eye(4).repeat(len(place), 1, 1)
        pose[:, :3, :3] = upright(columns)
        pose[:, :3, 3] = place
        return Targets(pose, (opened > 0).float(), (collides > 0).float())

    def _see(self, inputs: Inputs) -> "_Scene":
        c = self.config
        (at, colors), fine = (_groups(inputs, size) for size in c.groups)
        middle = at.mean(2)
        told = self.told(inputs, torch.zeros(len(at), 3))
        tokens = torch.cat([told, self.coarse(at, colors)], 1)
        places = F.pad(middle, (0, 0, tokens.shape[1] - middle.shape[1], 0))
        turns = self.rotary(places)
        for block in self.scene:
            tokens = block(tokens, turns=(turns, turns))
        return _Scene(
            tokens[:, 0], tokens[:, : -middle.shape[1]], tokens[:, -middle.shape[1] :], middle, *fine
        )

    def _ask(self, scene: "_Scene", ghosts: Tensor, stage: int, around: Tensor) -> Tensor:
        """(B, G, width) features of ghost points (B, G, 3); after the first stage of what lies `around`."""
        tokens, places = scene.coarse, scene.middle
        if stage:
            chosen = _nearest(places, around, self.config.near[0])
            tokens, places = _rows(tokens, chosen), _rows(places, chosen)
            chosen = _nearest(scene.points.mean(2), around, self.config.near[1])
            points, colors = _rows(scene.points, chosen), _rows(scene.colors, chosen)
            tokens = torch.cat([tokens, self.fine(points, colors)], 1)
            places = torch.cat([places, points.mean(2)], 1)
        context = torch.cat([scene.told, tokens], 1)
        turns = self.rotary(ghosts), self.rotary(F.pad(places, (0, 0, scene.told.shape[1], 0)))
        x = self.ghost.expand(*ghosts.shape[:2], -1)
        for block in self.asking:
            x = block(x, context, turns)
        return self.norm(x)  # type: ignore[no-any-return]

    def _scores(self, scene: "_Scene", features: Tensor, stage: int) -> Tensor:
        query = self.score[stage](scene.query)
        return torch.einsum("bgc,bc->bg", features.float(), query.float()) / query.shape[-1] ** 0.5

    def _act(self, scene: "_Scene", feature: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Two columns of the rotation (B, 2, 3) and scores of opening (B,) and collisions (B,)."""
        out = self.act(torch.cat([feature, scene.query], -1)).float()
        return out[:, :6].unflatten(-1, (2, 3)), out[:, 6], out[:, 7]


@dataclass(frozen=True, eq=False)
class _Scene:
    """Tokens of a scene.

    Attributes:
        query: (B, width) the gripper's.
        told: (B, T, width) the gripper's and those of the words.
        coarse, middle: (B, G, width) and their places (B, G, 3).
        points, colors: (B, F, K, 3) the fine groups, which become tokens when they are asked.
    """

    query: Tensor
    told: Tensor
    coarse: Tensor
    middle: Tensor
    points: Tensor
    colors: Tensor


def sample_ghosts(place: Tensor, stage: int, config: PointsConfig, count: int, miss: bool = False) -> Tensor:
    """(B, count, 3) ghost points: all over the workspace in the first stage, then in a ball.

    Args:
        place: (B, 3) the middle of the ball.
        stage: 0, 1 or 2.
        config: says how large the balls are.
        count: of points.
        miss: move the ball at random so that `place` stays within three quarters of its radius; in the first
            stage, one quarter of the points is sampled around the place.
    """
    B = len(place)
    if stage == 0:
        ghosts = torch.rand(B, count, 3) - 0.5
        if miss:
            some = count // 4
            ghosts[:, :some] = place[:, None] + _in_ball(B, some) * config.radii[0]
        return ghosts
    radius = config.radii[stage - 1]
    middle = place[:, None] + (_in_ball(B, 1) * 0.75 * radius if miss else 0)
    return middle + _in_ball(B, count) * radius


def _in_ball(B: int, count: int) -> Tensor:
    """(B, count, 3) evenly in the ball with radius 1."""
    return F.normalize(torch.randn(B, count, 3), dim=-1) * torch.rand(B, count, 1) ** (1 / 3)


def upright(columns: Tensor) -> Tensor:
    """(B, 3, 3) the rotations whose first two columns are like `columns` (B, 2, 3), by Gram and Schmidt."""
    x = F.normalize(columns[:, 0], dim=-1)
    y = F.normalize(columns[:, 1] - (x * columns[:, 1]).sum(-1, keepdim=True) * x, dim=-1)
    return torch.stack([x, y, torch.linalg.cross(x, y)], -1)


def _groups(inputs: Inputs, size: int) -> tuple[Tensor, Tensor]:
    return inputs.points.unflatten(1, (-1, size)), inputs.colors.unflatten(1, (-1, size))


def _nearest(places: Tensor, around: Tensor, count: int) -> Tensor:
    distance = (places - around[:, None]).square().sum(-1)
    return distance.topk(min(count, distance.shape[1]), largest=False).indices


def _rows(x: Tensor, chosen: Tensor) -> Tensor:
    return x[torch.arange(len(x))[:, None], chosen]
