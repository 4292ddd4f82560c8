"""Losses: focal and Dice for regions, likelihood for invariance, focal on true pairs, focal for routing."""

from collections.abc import Sequence

import torch
from torch import Tensor
from torch.nn import functional as F

GAMMA = 2.0


def focal(logits: Tensor, target: Tensor, cloud: Tensor, size: int) -> Tensor:
    """Binary focal loss -(1 - p)^2 log p of the true class, mean over each cloud's points, then over clouds.

    Args:
        logits: (M,) of all points.
        target: (M,) 0 or 1.
        cloud: (M,) number of each point's cloud.
        size: number of clouds.

    Source: Lin et al., Focal loss for dense object detection, ICCV 2017, without alpha.
    """
    truth = torch.where(target > 0.5, logits, -logits)
    values = torch.sigmoid(-truth) ** GAMMA * F.softplus(-truth)
    count = torch.bincount(cloud, minlength=size).clamp_min(1)
    return (values.new_zeros(size).index_add(0, cloud, values) / count).mean()


def dice(logits: Tensor, target: Tensor, cloud: Tensor, size: int, smooth: float = 1.0) -> Tensor:
    """Mean over clouds of 1 - Dice of sigmoid(logits) (M,) and target (M,).

    Args:
        logits: of all points.
        target: 0 or 1.
        cloud: (M,) number of each point's cloud.
        size: number of clouds.
        smooth: added above and below, so that empty clouds are defined.
    """
    p = torch.sigmoid(logits)

    def total(values: Tensor) -> Tensor:
        return values.new_zeros(size).index_add(0, cloud, values)

    overlap = 2 * total(p * target) + smooth
    return (1 - overlap / (total(p) + total(target) + smooth)).mean()


def spread(expected: Tensor, distance: Tensor, cloud: Tensor, size: int) -> Tensor:
    """Negative log-likelihood of an exponential distribution, log s + d / s, mean over clouds with labels.

    Args:
        expected: (M,) s, metres.
        distance: (M,) d, metres; NaN where it is not known. Clouds whose distances are all zero show the same
            thing twice and say nothing about others.
        cloud: (M,) number of each point's cloud.
        size: number of clouds.
    """
    known = distance.isfinite()
    d = torch.where(known, distance, 0.0)
    values = torch.where(known, expected.log() + d / expected, 0.0)

    def total(x: Tensor) -> Tensor:
        return x.new_zeros(size).index_add(0, cloud, x)

    count, another = total(known.to(d)), total(d) > 0
    mean = total(values) / count.clamp_min(1)
    return (mean * another).sum() / another.sum().clamp_min(1)


def matching(layers: Sequence[Tensor], targets: Sequence[Sequence[Tensor]]) -> Tensor:
    """Focal loss of the true pairs, summed over layers, mean over samples.

    Args:
        layers: (B, R, Q) correspondence matrices.
        targets: per sample, per right motion: (P, 2) row and column of true pairs.

    Where several motions are right, the one that the matrix agrees with best counts: any of them will do,
    their average would be none.
    """
    losses = []
    for b, motions in enumerate(targets):
        seen = [pairs for pairs in motions if len(pairs)]
        if seen:
            each = [torch.stack([_pairs(m[b], pairs) for pairs in seen]).min() for m in layers]
            losses.append(torch.stack(each).sum())
    return torch.stack(losses).mean() if losses else layers[-1].sum() * 0.0


def _pairs(matrix: Tensor, pairs: Tensor) -> Tensor:
    p = matrix[pairs[:, 0], pairs[:, 1]].clamp(1e-6, 1 - 1e-6)
    return -((1 - p) ** GAMMA * p.log()).mean()


def routing(scores: Tensor, right: Tensor) -> Tensor:
    """Mean focal loss of the right steps under the softmax of scores (B, L).

    Of several right steps, marked in `right` (B, L), any will do: their probabilities add up.
    """
    log_p = scores.log_softmax(dim=1).masked_fill(~right, -torch.inf).logsumexp(dim=1)
    return -((1 - log_p.exp()) ** GAMMA * log_p).mean()


def pose(found: Tensor, right: Sequence[Tensor]) -> Tensor:
    """Mean over samples of how far a pose is from the nearest right one.

    Args:
        found: (B, 4, 4).
        right: per sample (S, 4, 4).

    Distance in units of 5 cm and turn in units of about 20 degrees, each linear where it is more than one.
    """
    losses = []
    for T, several in zip(found, right, strict=True):
        several = several.to(T)
        away = (T[:3, 3] - several[:, :3, 3]).square().sum(-1)
        turn = (T[:3, :3] - several[:, :3, :3]).square().sum((-2, -1))
        far = torch.stack([away / 0.05**2, turn / 0.5**2])
        losses.append((1 + far).sqrt().sub(1).sum(0).min())
    return torch.stack(losses).mean()
