"""Weighted least-squares fit of a rigid motion to matched points (the paper's Eq. 2), differentiable."""

from dataclasses import dataclass

import roma
import torch
from torch import Tensor

from imop.errors import InvalidInput


@dataclass(frozen=True)
class Procrustes:
    """The best rigid motions, and how well the points determine them.

    Attributes:
        T_y_x: (..., 4, 4).
        rank: (...,) int64. 3 or 2: unique (2: the points of one side lie in a plane). 1: collinear, the turn
            about the line is free and the smallest rotation was taken. 0: the points coincide (or there is
            one), no rotation was applied. -1: no points or no weight, identity.
    """

    T_y_x: Tensor
    rank: Tensor

    @property
    def unique(self) -> Tensor:
        """(...,) bool, whether the points determine the motion."""
        return self.rank >= 2


def weighted_procrustes(x: Tensor, y: Tensor, weights: Tensor | None = None) -> Procrustes:
    """The T in SE(3) with least sum_n w_n ||T x_n - y_n||^2, for any batch dimensions.

    Args:
        x: (..., N, 3), the points that are moved.
        y: (..., N, 3), where they should go.
        weights: (..., N), not negative; ones if None.

    Reflections are never returned. Gradients flow to x, y and weights; where the motion is not unique
    they flow through the translation alone.

    Raises:
        InvalidInput: for other shapes, negative or non-finite values.

    Source: Kabsch 1976, Umeyama 1991; derivative of the projection onto SO(3) by roma.
    """
    _check(x, y, weights)
    w = torch.ones_like(x[..., 0]) if weights is None else weights
    total = w.sum(-1, keepdim=True)
    w = w / torch.where(total > 0, total, torch.ones_like(total))
    mean_x, mean_y = (w[..., None] * x).sum(-2), (w[..., None] * y).sum(-2)
    dx, dy = x - mean_x[..., None, :], y - mean_y[..., None, :]
    covariance = (w[..., None] * dy).mT @ dx

    rank = torch.where(
        total[..., 0] > 0, _rank(covariance, w, dx, dy), -torch.ones_like(total[..., 0]).long()
    )
    unique = (rank >= 2)[..., None, None]
    eye = torch.eye(3, dtype=x.dtype, device=x.device).expand_as(covariance)
    R = roma.special_procrustes(torch.where(unique, covariance, eye))
    line = (rank == 1)[..., None, None]
    R = torch.where(line, _smallest_rotation(torch.where(line, covariance, eye).detach()), R)
    translation = mean_y - (R @ mean_x[..., None])[..., 0]

    top = torch.cat([R, translation[..., None]], dim=-1)
    bottom = torch.tensor([0.0, 0.0, 0.0, 1.0], dtype=x.dtype, device=x.device)
    return Procrustes(torch.cat([top, bottom.expand(*top.shape[:-2], 1, 4)], dim=-2), rank)


def _check(x: Tensor, y: Tensor, weights: Tensor | None) -> None:
    if x.ndim < 2 or x.shape[-1] != 3 or x.shape != y.shape:
        raise InvalidInput(
            "x, y", f"shapes {tuple(x.shape)} and {tuple(y.shape)}", "the same shape (..., N, 3)"
        )
    if not (x.dtype == y.dtype and x.is_floating_point()):
        raise InvalidInput("x, y", f"dtypes {x.dtype} and {y.dtype}", "the same floating-point dtype")
    if not (torch.isfinite(x).all() and torch.isfinite(y).all()):
        raise InvalidInput("x, y", "not finite", "finite coordinates in metres")
    if weights is None:
        return
    if weights.shape != x.shape[:-1] or weights.dtype != x.dtype:
        problem = f"shape {tuple(weights.shape)}, {weights.dtype}"
        raise InvalidInput("weights", problem, f"shape {tuple(x.shape[:-1])}, {x.dtype}")
    if not (torch.isfinite(weights).all() and (weights >= 0).all()):
        raise InvalidInput("weights", "negative or not finite", "finite numbers >= 0")


@torch.no_grad()
def _rank(covariance: Tensor, w: Tensor, dx: Tensor, dy: Tensor) -> Tensor:
    """Singular values of the cross covariance that stand above rounding; 0 if the points coincide."""
    eps = torch.finfo(covariance.dtype).eps
    spread = [(w * d.square().sum(-1)).sum(-1) for d in (dx, dy)]
    scale = (spread[0] * spread[1]).sqrt()
    singular = torch.linalg.svdvals(covariance)
    # Coordinates of a metre carry eps of rounding, so points closer than a few hundred eps coincide.
    spread_out = torch.minimum(*spread) > (300 * eps) ** 2
    above = singular > (100 * eps) * scale[..., None]
    return torch.where(spread_out, above.sum(-1), torch.zeros_like(above.sum(-1)))


def _smallest_rotation(covariance: Tensor) -> Tensor:
    """(..., 3, 3) the rotation of least angle that carries the line of x onto the line of y."""
    U, _, Vh = torch.linalg.svd(covariance)
    a, b = Vh[..., 0, :], U[..., :, 0]
    axis = torch.linalg.cross(a, b)
    cosine = (a * b).sum(-1, keepdim=True)
    # Opposite directions: half a turn about any axis across the line.
    across = Vh[..., 1, :]
    opposite = cosine < -1 + 1e-6
    half_turn = 2 * across[..., :, None] * across[..., None, :] - torch.eye(3).to(covariance)
    K = _cross_matrix(axis)
    turn = torch.eye(3).to(covariance) + K + K @ K / (1 + torch.where(opposite, 0, cosine))[..., None]
    return torch.where(opposite[..., None], half_turn, turn)


def _cross_matrix(v: Tensor) -> Tensor:
    x, y, z = v.unbind(-1)
    zero = torch.zeros_like(x)
    return torch.stack([zero, -z, y, z, zero, -x, -y, x, zero], dim=-1).reshape(*v.shape[:-1], 3, 3)
