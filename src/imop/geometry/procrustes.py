"""Weighted least-squares fit of a rigid motion to matched points (the paper's Eq. 2), differentiable."""

from collections.abc import Sequence
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
    w = w / torch.where(total > 0, total, 1.0)
    mean_x, mean_y, dx, dy, covariance = _moments(x, y, w)

    with torch.no_grad():
        U, singular, Vh = torch.linalg.svd(covariance)
        rank = torch.where(total[..., 0] > 0, _rank(singular, w, dx, dy), -1)
    unique = (rank >= 2)[..., None, None]
    eye = torch.eye(3, dtype=x.dtype, device=x.device).expand_as(covariance)
    if covariance.requires_grad:
        R = roma.special_procrustes(torch.where(unique, covariance, eye))
    else:
        R = torch.where(unique, _rotation(U, Vh), eye)
    line = (rank == 1)[..., None, None]
    if line.any():
        R = torch.where(line, _smallest_rotation(U, Vh), R)
    return Procrustes(_pose(R, mean_y - R @ mean_x), rank)


@torch.no_grad()
def robust_procrustes(x: Tensor, y: Tensor, weights: Tensor, reaches: Sequence[float]) -> Tensor:
    """(..., 4, 4) the motion that most pairs agree on: least squares, weighted anew for every reach.

    A pair that is d from where the motion before carried it counts 1 / (1 + (d / reach)^2)^2 of its weight.
    No gradient. Where a few hundred pairs are asked for in an instant, what `weighted_procrustes` tells of
    their rank costs more than the fit.

    Args:
        x: (..., N, 3), the points that are moved.
        y: (..., N, 3), where they should go.
        weights: (..., N), not negative.
        reaches: in the unit of the points, decreasing.
    """
    R, t = _fit(x, y, weights)
    for reach in reaches:
        off = (x @ R.mT + t.mT - y) / reach
        R, t = _fit(x, y, weights / (1 + off.square().sum(-1)).square())
    return _pose(R, t)


def _fit(x: Tensor, y: Tensor, weights: Tensor) -> tuple[Tensor, Tensor]:
    """(..., 3, 3) rotation and (..., 3, 1) translation of least squares; any one of several if not unique."""
    w = weights / weights.sum(-1, keepdim=True).clamp_min(torch.finfo(weights.dtype).tiny)
    mean_x, mean_y, _, _, covariance = _moments(x, y, w)
    U, _, Vh = torch.linalg.svd(covariance)
    R = _rotation(U, Vh)
    return R, mean_y - R @ mean_x


def _moments(x: Tensor, y: Tensor, w: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor, Tensor]:
    """Means (..., 3, 1) of both sides, offsets from them, and the cross covariance; `w` sums to 1."""
    mean_x, mean_y = x.mT @ w[..., None], y.mT @ w[..., None]
    dx, dy = x - mean_x.mT, y - mean_y.mT
    return mean_x, mean_y, dx, dy, (w[..., None] * dy).mT @ dx


def _pose(R: Tensor, t: Tensor) -> Tensor:
    """(..., 4, 4) of rotations (..., 3, 3) and translations (..., 3, 1)."""
    bottom = torch.tensor([0.0, 0.0, 0.0, 1.0], dtype=R.dtype, device=R.device)
    return torch.cat([torch.cat([R, t], dim=-1), bottom.expand(*R.shape[:-2], 1, 4)], dim=-2)


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


def _rotation(U: Tensor, Vh: Tensor) -> Tensor:
    """(..., 3, 3) the rotation nearest to U diag(s) Vh, for s not increasing."""
    # The last axis is turned over where the product of the others would be a reflection.
    last = torch.linalg.det(U @ Vh).sign()[..., None, None] * U[..., :, 2:] @ Vh[..., 2:, :]
    R: Tensor = U[..., :, :2] @ Vh[..., :2, :] + last
    return R


def _rank(singular: Tensor, w: Tensor, dx: Tensor, dy: Tensor) -> Tensor:
    """Singular values of the cross covariance that stand above rounding; 0 if the points coincide."""
    eps = torch.finfo(singular.dtype).eps
    spread = [(w * d.square().sum(-1)).sum(-1) for d in (dx, dy)]
    scale = (spread[0] * spread[1]).sqrt()
    # Coordinates of a metre carry eps of rounding, so points closer than a few hundred eps coincide.
    spread_out = torch.minimum(*spread) > (300 * eps) ** 2
    above = singular > (100 * eps) * scale[..., None]
    return torch.where(spread_out, above.sum(-1), torch.zeros_like(above.sum(-1)))


def _smallest_rotation(U: Tensor, Vh: Tensor) -> Tensor:
    """(..., 3, 3) the rotation of least angle that carries the line of x onto the line of y."""
    a, b = Vh[..., 0, :], U[..., :, 0]
    axis = torch.linalg.cross(a, b)
    cosine = (a * b).sum(-1, keepdim=True)
    # Opposite directions: half a turn about any axis across the line.
    across = Vh[..., 1, :]
    opposite = cosine < -1 + 1e-6
    half_turn = 2 * across[..., :, None] * across[..., None, :] - torch.eye(3).to(U)
    K = _cross_matrix(axis)
    turn = torch.eye(3).to(U) + K + K @ K / (1 + torch.where(opposite, 0, cosine))[..., None]
    return torch.where(opposite[..., None], half_turn, turn)


def _cross_matrix(v: Tensor) -> Tensor:
    x, y, z = v.unbind(-1)
    zero = torch.zeros_like(x)
    return torch.stack([zero, -z, y, z, zero, -x, -y, x, zero], dim=-1).reshape(*v.shape[:-1], 3, 3)
