"""Where the region may have gone: motions that are worth a look, by who proposes them.

| generator | proposes |
|---|---|
| `hint` | the motion of the step before |
| `gripper` | what the gripper has done since the demonstration, for what it holds |
| `fit` | what most matches agree on, by least squares over all points of the region |
| `firm` | the same, weighted by how little each point may differ |
| `matches` | what some matches agree on, by sampled triples |
| `upright` | every turn on the things that most matches lead to |
| `anywhere` | every turn on every thing |
| `half_turn` | half a turn after what was found |
| `straight` | what was found, turned as the gripper was in the demonstration |
| `part`, `payload` | the same as `matches` and `upright` for what is next to the gripper, and what it takes |
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from imop.geometry import se3
from imop.geometry.cloud import PointCloud, farthest_points
from imop.geometry.clusters import connected
from imop.geometry.icp import Refiner, upright
from imop.geometry.neighbours import nearest, within
from imop.geometry.ransac import agreement, sample_motions
from imop.networks.graph import Graph
from imop.types import FloatArray

# Two observations of one surface are this near to each other, metres.
SAME = 0.012
# Share of the matches that must lead to a thing for the region to be set upright on it.
SOME = 0.1
# Upright turns of one place, and how many things the region is set upright on by its matches.
TURNS, PLACES = 24, 2
# Triples of matches that are drawn, and the seed of the draw.
SAMPLES, SEED = 4000, 0
# Axes of half turns and of equal turns that are tried, metres off the middle.
AXES, OFF = (-0.05, -0.025, 0.0, 0.025, 0.05), (-0.008, 0.0, 0.008)
# Share of a thing that has to look the same after a turn, how near that is (metres), and on how many points.
ALIKE, NEAR, POINTS = 0.8, 0.006, 200


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

    def agreement(self, T: FloatArray, tolerance: float) -> FloatArray:
        """(H,) share of the matches that each motion (H, 4, 4) carries nearer than `tolerance`, metres."""
        return agreement(T, self.x, self.y, self.weight, tolerance)

    def motions(self) -> FloatArray:
        """(H, 4, 4) motions that some matches agree on."""
        if not len(self.x):
            return np.zeros((0, 4, 4))
        return sample_motions(self.x, self.y, self.n_x, self.n_y, self.weight, samples=SAMPLES, seed=SEED)

    def upright(
        self, points: FloatArray, labels: NDArray[np.int64], middles: Sequence[FloatArray]
    ) -> FloatArray:
        """(H, 4, 4) motions, in every turn, to the things that most of the region was matched to.

        Where something is, the matches say long before they say how it is turned.

        Args:
            points: (N, 3) of the query.
            labels: (N,) numbers of the things that they belong to.
            middles: points (3,) of the region that may come to the middle of the thing.
        """
        seeds = [np.zeros((0, 4, 4))]
        if not len(self.x):
            return seeds[0]
        thing = labels[nearest(self.y, points)[1][:, 0]]
        weights = np.bincount(thing, weights=self.weight, minlength=labels.max() + 1)
        for label in np.argsort(-weights)[:PLACES]:
            w = self.weight * (thing == label)
            if w.sum() > SOME * self.weight.sum():
                x, y = (np.average(p, axis=0, weights=w) for p in (self.x, self.y))
                seeds.append(upright_motions(x, y[None]))
                place = middle(points[labels == label])[None]
                seeds += [upright_motions(center, place) for center in middles]
        return np.concatenate(seeds)


def likeliest(
    C: Tensor, region: Graph, chosen: Tensor, query: Graph, weight: FloatArray, count: int
) -> Matches:
    """The likeliest query points of every region point.

    Args:
        C: (R, N) correspondence matrix.
        region: the demonstrated scene.
        chosen: (R,) its points that are the region.
        query: the observed scene, of N points.
        weight: (R,) of the region's points.
        count: how many for each.
    """
    likely, best = C.topk(min(count, C.shape[1]), dim=1)
    i = torch.arange(len(likely)).repeat_interleave(likely.shape[1])
    x, n_x = (values[chosen][i].double().numpy() for values in _surface(region))
    y, n_y = (values[best.flatten()].double().numpy() for values in _surface(query))
    return Matches(x, n_x, y, n_y, likely.flatten().double().numpy() * weight[i] + 1e-6)


def _surface(graph: Graph) -> tuple[Tensor, Tensor]:
    return graph.levels[0].points, graph.levels[0].normals


def middle(points: FloatArray) -> FloatArray:
    """Centre of the bounding box: which side was seen shifts it less than the mean."""
    center: FloatArray = (points.min(axis=0) + points.max(axis=0)) / 2
    return center


def upright_motions(center: FloatArray, places: FloatArray) -> FloatArray:
    """(P * TURNS, 4, 4) motions that carry `center` (3,) to places (P, 3), in all upright turns."""
    yaw = np.linspace(0.0, 2 * np.pi, TURNS, endpoint=False)
    R = np.tile(np.stack([se3.euler(z=float(angle)) for angle in yaw]), (len(places), 1, 1))
    return se3.make(R, np.repeat(places, TURNS, axis=0) - R @ center)


def straightened(T: FloatArray, T_straight: FloatArray, p: FloatArray) -> FloatArray:
    """(4, 4) the motion `T_straight`, carried on to where `T` takes a point (3,)."""
    moved = T_straight.copy()
    moved[:3, 3] += (se3.apply(T, p[None]) - se3.apply(T_straight, p[None]))[0]
    return moved


def half_turn(points: FloatArray) -> FloatArray:
    """(4, 4) the half turn about the vertical that best lays a thing (N, 3) onto itself.

    Most things look alike from both ends, about an axis that need not go through the middle of what was seen:
    a faucet's goes through its base, whichever way the spout points.
    """
    few, R = points[farthest_points(points, POINTS)], se3.euler(z=np.pi)
    axes = [middle(points) + np.array([x, y, 0.0]) for x, y in product(AXES, AXES)]
    motions = np.stack([se3.make(R, axis - R @ axis) for axis in axes])
    best = motions[np.argsort(-_onto(few, points, motions), kind="stable")[:4]]
    if len(points) >= 5:
        refine = Refiner(points)
        best = np.stack([*best, *(upright(refine(few, T), middle(points)) for T in best)])
    chosen: FloatArray = best[np.argmax(_onto(few, points, best))]
    return chosen


def equal_turns(cloud: PointCloud) -> FloatArray:
    """(S, 4, 4) turns about the vertical after which a region looks the same; the first is the identity.

    Of round things the networks match any side to any. A lone half turn is not counted: front and back of
    most things look alike from afar, and differ.
    """
    points, center = cloud.points, middle(cloud.points)
    few, found = points[farthest_points(points, POINTS)], []
    for angle in np.radians(np.arange(45.0, 360.0, 45.0)):
        R = se3.euler(z=float(angle))
        motions = np.stack([se3.make(R, center - R @ center + (x, y, 0.0)) for x, y in product(OFF, OFF)])
        alike = _onto(few, points, motions)
        if alike.max() > ALIKE:
            found.append((angle, motions[int(np.argmax(alike))]))
    if all(np.isclose(angle, np.pi) for angle, _ in found):
        found = []
    return np.stack([np.eye(4), *(T for _, T in found)])


def thing_of(points: FloatArray, standing: FloatArray) -> FloatArray:
    """(N, 3) the connected thing among `standing` points (M, 3) that most of `points` are part of."""
    if not len(standing):
        return points
    labels = connected(standing)
    part_of = labels[nearest(points, standing)[1][:, 0]]
    thing: FloatArray = standing[labels == np.bincount(part_of).argmax()]
    return thing


def _onto(few: FloatArray, points: FloatArray, motions: FloatArray) -> FloatArray:
    """(H,) share of `few` points that motions (H, 4, 4) carry near to `points`."""
    moved = se3.apply(motions, few)
    distance = nearest(moved.reshape(-1, 3), points)[0].reshape(len(motions), -1)
    share: FloatArray = (distance < NEAR).mean(axis=1)
    return share
