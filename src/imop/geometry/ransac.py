"""Several rigid motions from correspondences, instead of their average.

Least squares over all pairs averages equal instances into a place where none is. Here each motion comes from
three pairs whose distances and normals agree, and near duplicates are merged.
"""

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from imop.geometry import se3
from imop.geometry.procrustes import weighted_procrustes
from imop.types import BoolArray, FloatArray


@dataclass(frozen=True, eq=False)
class Correspondences:
    """Weighted pairs of points, the sparse form of the paper's matrix C.

    Attributes:
        i_support: (K,) indices into the region's points.
        i_query: (K,) indices into the query's points.
        weight: (K,) not negative.
    """

    i_support: NDArray[np.int64]
    i_query: NDArray[np.int64]
    weight: FloatArray

    def __len__(self) -> int:
        return len(self.weight)


def mutual_matches(
    support: FloatArray, query: FloatArray, keep: int = 3, ratio: float = 0.98
) -> Correspondences:
    """Pairs of descriptors (M, D) and (N, D) that choose each other.

    A pair is kept if the query is the nearest to the support descriptor and the support one is among the
    `keep` nearest to the query's. The weight falls with the ratio of the nearest to the second nearest
    distance; above `ratio` it is small but not nothing, for repeated parts are all ambiguous.
    """
    if min(len(support), len(query)) < 2:
        nothing = np.zeros(0, dtype=np.int64)
        return Correspondences(nothing, nothing, np.zeros(0))
    distance = torch.cdist(torch.from_numpy(support).float(), torch.from_numpy(query).float())
    best, i_query = distance.topk(2, dim=1, largest=False)
    keep = min(keep, len(support))
    back = distance.topk(keep, dim=0, largest=False).indices.numpy()
    i_support = np.arange(len(support))
    nearest = i_query[:, 0].numpy()
    mutual = np.any(back[:, nearest] == i_support, axis=0)
    ambiguity = (best[:, 0] / best[:, 1].clamp_min(1e-9)).numpy().astype(np.float64)
    weight = np.where(ambiguity < ratio, 1.0 - ambiguity, 0.2 * (1.0 - ratio))
    return Correspondences(i_support[mutual], nearest[mutual].astype(np.int64), weight[mutual] + 1e-3)


def sample_motions(
    x: FloatArray,
    y: FloatArray,
    normals_x: FloatArray,
    normals_y: FloatArray,
    weight: FloatArray,
    *,
    tolerance: float = 0.015,
    samples: int = 20_000,
    keep: int = 20,
    seed: int = 0,
) -> FloatArray:
    """Rigid motions that many of the pairs x -> y agree on, most supported first, distinct.

    Args:
        x: (K, 3) points that are moved, metres.
        y: (K, 3) where they should go.
        normals_x: (K, 3) unit normals at x.
        normals_y: (K, 3) unit normals at y.
        weight: (K,) how likely a pair is drawn and how much it counts.
        tolerance: largest distance of an agreeing pair, metres.
        samples: triples drawn.
        keep: number of motions returned at most.
        seed: of the draw.

    Returns:
        (H, 4, 4) with H <= keep; H = 0 if no triple was consistent.
    """
    none = np.zeros((0, 4, 4))
    if len(x) < 3:
        return none
    rng = np.random.default_rng(seed)
    triples = rng.choice(len(x), size=(samples, 3), p=weight / weight.sum())
    triples = triples[_consistent(x, y, normals_x, normals_y, triples, tolerance)][:1500]
    if not len(triples):
        return none
    fit = weighted_procrustes(torch.from_numpy(x[triples]), torch.from_numpy(y[triples]))
    T = fit.T_y_x[fit.rank >= 2].numpy()
    T = T[np.argsort(-agreement(T, x, y, weight, tolerance), kind="stable")[: 10 * keep]]
    T = refit(T, x, y, weight, tolerance)
    order = np.argsort(-agreement(T, x, y, weight, tolerance), kind="stable")
    chosen = distinct(T[order], center=x.mean(axis=0), keep=keep)
    return np.asarray(T[order][chosen])


def _consistent(
    x: FloatArray,
    y: FloatArray,
    normals_x: FloatArray,
    normals_y: FloatArray,
    triples: NDArray[np.int64],
    tolerance: float,
) -> BoolArray:
    """(S,) whether a triple's edges are long enough, equally long, and equally inclined to the normals."""
    good = np.ones(len(triples), dtype=bool)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        i, j = triples[:, a], triples[:, b]
        edge_x, edge_y = x[j] - x[i], y[j] - y[i]
        length_x, length_y = np.linalg.norm(edge_x, axis=1), np.linalg.norm(edge_y, axis=1)
        good &= (length_x > 2 * tolerance) & (np.abs(length_x - length_y) < tolerance)
        bend_x = np.einsum("sk,sk->s", normals_x[i], normals_x[j])
        bend_y = np.einsum("sk,sk->s", normals_y[i], normals_y[j])
        good &= np.abs(bend_x - bend_y) < 0.3
        lean_x = np.einsum("sk,sk->s", normals_x[i], edge_x) / np.maximum(length_x, 1e-9)
        lean_y = np.einsum("sk,sk->s", normals_y[i], edge_y) / np.maximum(length_y, 1e-9)
        good &= np.abs(lean_x - lean_y) < 0.35
    return good


def agreement(
    T: FloatArray, x: FloatArray, y: FloatArray, weight: FloatArray, tolerance: float = 0.015
) -> FloatArray:
    """(H,) share, by weight, of the pairs x -> y (K, 3) that each motion carries nearer than `tolerance`."""
    distance = np.linalg.norm(se3.apply(T, x) - y, axis=-1)
    share: FloatArray = (weight * (distance < tolerance)).sum(axis=-1) / max(weight.sum(), 1e-12)
    return share


def refit(T: FloatArray, x: FloatArray, y: FloatArray, weight: FloatArray, tolerance: float) -> FloatArray:
    """Weighted least squares over the pairs that agree with each motion (H, 4, 4)."""
    inlier = np.linalg.norm(se3.apply(T, x) - y, axis=-1) < tolerance
    w = torch.from_numpy(weight * inlier)
    fit = weighted_procrustes(
        torch.from_numpy(x).expand(len(T), -1, -1), torch.from_numpy(y).expand(len(T), -1, -1), w
    )
    return np.where((fit.rank >= 2).numpy()[:, None, None], fit.T_y_x.numpy(), T)


def distinct(
    T: FloatArray, center: FloatArray, keep: int, distance: float = 0.02, angle: float = 0.2
) -> list[int]:
    """Non-maximum suppression in SE(3): indices of motions that differ from all before them, in order.

    Two motions are the same if they carry `center` (3,) nearer than `distance` metres to each other and turn
    by less than `angle` radians against each other.
    """
    moved = se3.apply(T, center[None])[:, 0]
    columns = T[:, :3, :3].reshape(-1, 9)
    # Of a relative rotation by an angle, the trace is 1 + 2 cos(angle).
    turned = columns @ columns.T > 1 + 2 * np.cos(angle)
    chosen: list[int] = []
    for i in range(len(T)):
        if len(chosen) == keep:
            break
        if not np.any(turned[i, chosen] & (np.linalg.norm(moved[chosen] - moved[i], axis=1) < distance)):
            chosen.append(i)
    return chosen
