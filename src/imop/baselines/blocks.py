"""What both regressors are made of: a transformer block, and tokens of words and of the gripper."""

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from imop.baselines.batch import Inputs
from imop.baselines.words import BUCKETS, LENGTH

RANK = 16
"""Width of the adapters' bottleneck."""
_STEPS = 32


class Block(nn.Module):
    """Attention and a perceptron, each behind a norm and added to what was there."""

    def __init__(self, width: int, heads: int):
        super().__init__()
        self.heads = heads
        self.norm, self.norm_context, self.norm_out = (nn.LayerNorm(width) for _ in range(3))
        self.query, self.out = nn.Linear(width, width), nn.Linear(width, width)
        self.key_value = nn.Linear(width, 2 * width)
        self.perceptron = nn.Sequential(nn.Linear(width, 4 * width), nn.GELU(), nn.Linear(4 * width, width))

    def forward(
        self,
        x: Tensor,
        context: Tensor | None = None,
        turns: tuple[Tensor, Tensor] | None = None,
        adapter: Tensor | None = None,
    ) -> Tensor:
        """Let tokens attend to each other or to a context.

        Args:
            x: (B, N, width).
            context: (B, M, width); x itself if None.
            turns: angles of the tokens and of the context, see `Rotary`; attention then depends on relative
                positions.
            adapter: (B, adapter_size(width)) weights of a bottleneck behind the block; none if None.
        """
        normed = self.norm(x)
        other = normed if context is None else self.norm_context(context)
        q, (k, v) = self._split(self.query(normed)), map(self._split, self.key_value(other).chunk(2, -1))
        if turns is not None:
            q, k = _turned(q, turns[0]), _turned(k, turns[1])
        # Written out: on a CPU the gradient of torch's fused attention takes five times as long.
        shares = (q * q.shape[-1] ** -0.5 @ k.transpose(-1, -2)).softmax(-1)
        x = x + self.out((shares.to(v.dtype) @ v).transpose(1, 2).flatten(2))
        x = x + self.perceptron(self.norm_out(x))
        return x if adapter is None else x + _bottleneck(x, adapter)

    def _split(self, x: Tensor) -> Tensor:
        return x.unflatten(-1, (self.heads, -1)).transpose(1, 2)


def adapter_size(width: int) -> int:
    """Numbers in the weights of one adapter: down to `RANK`, and up again."""
    return 2 * RANK * width


def _bottleneck(x: Tensor, adapter: Tensor) -> Tensor:
    width = x.shape[-1]
    down, up = adapter.unflatten(-1, (2, RANK, width)).unbind(1)
    return F.gelu(F.layer_norm(x, (width,)) @ down.transpose(1, 2)) @ up


class Rotary(nn.Module):
    """Angles by which pairs of channels are turned, so that products depend on relative positions only.

    Args:
        channels: of one head; a multiple of 6.
        longest, shortest: wavelengths, metres.
    """

    frequencies: Tensor

    def __init__(self, channels: int, longest: float = 4.0, shortest: float = 0.03):
        super().__init__()
        lengths = torch.logspace(0, 1, channels // 6, base=shortest / longest) * longest
        self.register_buffer("frequencies", 2 * torch.pi / lengths, persistent=False)

    def forward(self, positions: Tensor) -> Tensor:
        """(B, 1, N, channels / 2) angles of positions (B, N, 3)."""
        return (positions[..., None] * self.frequencies).flatten(2)[:, None]


def _turned(x: Tensor, angles: Tensor) -> Tensor:
    first, second = x.float().chunk(2, -1)
    c, s = angles.cos(), angles.sin()
    return torch.cat([first * c - second * s, first * s + second * c], -1).to(x.dtype)


class Told(nn.Module):
    """Tokens of what no camera sees: the words, and one of the gripper and the step.

    Their places are relative to `origin`, so that a second look can ask where the gripper is from there.
    """

    def __init__(self, width: int):
        super().__init__()
        self.word = nn.Embedding(BUCKETS, width, padding_idx=0)
        self.place = nn.Parameter(torch.randn(LENGTH, width) * 0.02)
        self.step = nn.Embedding(_STEPS, width)
        self.gripper = nn.Sequential(nn.Linear(13, width), nn.GELU(), nn.Linear(width, width))
        for embedding in (self.word, self.step):
            nn.init.normal_(embedding.weight, std=0.3)

    def forward(self, inputs: Inputs, origin: Tensor) -> Tensor:
        """(B, LENGTH + 1, width), the gripper first; origin (B, 3)."""
        T = inputs.gripper
        place = (T[:, :3, 3] - origin) * 5
        state = torch.cat([place, T[:, :3, :2].flatten(1), inputs.opening[:, None], origin * 5], 1)
        gripper = self.gripper(state) + self.step(inputs.step.clamp(0, _STEPS - 1))
        return torch.cat([gripper[:, None], self.word(inputs.words) + self.place], 1)
