"""Which points of the query the points of a region are, as the matching network says it: the paper's C."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from imop.geometry.neighbours import nearest, within
from imop.geometry.ransac import agreement, sample_motions
from imop.networks.graph import Graph
from imop.policy.contacts import SAME
from imop.policy.search import upright_motions
from imop.policy.things import Standing, middle
from imop.types import FloatArray

# Share of the matches that must lead to a thing for the region to be set upright on it.
_SOME = 0.1


@dataclass(frozen=True, eq=False)
class Matches:
    """Pairs of points; several may share the one of the region.

    Attributes:
        x: (K, 3) points of the region, metres.
        n_x: (K, 3) their normals.
        y: (K, 3) points of the query, metres.
        n_y: (K, 3) their normals.
        weight: (K,) how likely they belong together.
    """

    x: FloatArray
    n_x: FloatArray
    y: FloatArray
    n_y: FloatArray
    weight: FloatArray

    def of(self, points: FloatArray) -> "Matches":
        """Those of what is around points (N, 3) of the region."""
        kept = within(self.x, points, SAME)
        return Matches(*(values[kept] for values in (self.x, self.n_x, self.y, self.n_y, self.weight)))

    def agreement(self, T: FloatArray, tolerance: float = 0.015) -> FloatArray:
        """(H,) share of the matches that each motion (H, 4, 4) carries nearer than `tolerance`, metres."""
        return agreement(T, self.x, self.y, self.weight, tolerance)

    def motions(self, samples: int, seed: int) -> FloatArray:
        """(H, 4, 4) motions that some matches agree on, from so many triples of them."""
        if not len(self.x):
            return np.zeros((0, 4, 4))
        return sample_motions(self.x, self.y, self.n_x, self.n_y, self.weight, samples=samples, seed=seed)

    def upright(self, things: Standing, places: int, turns: int, middles: Sequence[FloatArray]) -> FloatArray:
        """(H, 4, 4) motions, in every turn, to the things that most of the region was matched to.

        Where something is, the matches say long before they say how it is turned.

        Args:
            things: of the query.
            places: how many of them at most.
            turns: how often, over a full turn.
            middles: points (3,) of the region that may come to the middle of the thing.
        """
        seeds = [np.zeros((0, 4, 4))]
        if not len(self.x):
            return seeds[0]
        points, labels = things.cloud.points, things.labels
        thing = labels[nearest(self.y, points)[1][:, 0]]
        weights = np.bincount(thing, weights=self.weight, minlength=labels.max() + 1)
        for label in np.argsort(-weights)[:places]:
            w = self.weight * (thing == label)
            if w.sum() > _SOME * self.weight.sum():
                x, y = (np.average(points, axis=0, weights=w) for points in (self.x, self.y))
                seeds.append(upright_motions(x, y[None], turns))
                place = middle(points[labels == label])[None]
                seeds += [upright_motions(center, place, turns) for center in middles]
        return np.concatenate(seeds)


def likeliest(
    C: Tensor, region: Graph, chosen: Tensor, query: Graph, probability: FloatArray, candidates: int
) -> Matches:
    """The likeliest query points of every region point.

    Args:
        C: (R, N) correspondence matrix.
        region: the demonstrated scene.
        chosen: (R,) its points that are the region.
        query: the observed scene, of N points.
        probability: (R,) of being in the region.
        candidates: how many for each.
    """
    weight, best = C.topk(min(candidates, C.shape[1]), dim=1)
    i = torch.arange(len(weight)).repeat_interleave(weight.shape[1])
    x, n_x = (values[chosen][i].double().numpy() for values in _surface(region))
    y, n_y = (values[best.flatten()].double().numpy() for values in _surface(query))
    return Matches(x, n_x, y, n_y, weight.flatten().double().numpy() * probability[i] + 1e-6)


def _surface(graph: Graph) -> tuple[Tensor, Tensor]:
    return graph.levels[0].points, graph.levels[0].normals
