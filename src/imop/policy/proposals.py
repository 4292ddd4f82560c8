"""Where the region may have gone: motions that are worth a look, by who proposes them.

| generator | proposes |
|---|---|
| `hint` | the motion of the step before |
| `gripper` | what the gripper has done since the demonstration, for what it holds |
| `fit` | what most matches agree on, by least squares over all points of the region |
| `firm` | the same, weighted by how little each point may differ |
| `matches` | what some matches agree on, by sampled triples, and every turn where most of them lead |
| `upright` | what was found, set upright |
| `anywhere` | every turn on every thing |
| `turn` | what was found, in those turns that leave the shape as it is and fit its paint best |
| `half_turn` | half a turn after what was found |
| `straight` | what was found, turned as the gripper was in the demonstration |
| `exact` | what was found, laid exactly onto what was seen |
| `goal` | every turn on every thing, for what stands where the hand goes |
| `part`, `payload` | the same as `matches` for what is next to the gripper, and for what it takes next |
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from imop.geometry import se3
from imop.geometry.cloud import PointCloud, farthest_points
from imop.geometry.icp import Refiner, upright
from imop.geometry.neighbours import nearest, within
from imop.geometry.ransac import agreement, sample_motions
from imop.policy.contacts import SAME
from imop.policy.target import Target, middle
from imop.types import FloatArray

# Share of the matches that must lead to a thing for the region to be set upright on it.
SOME = 0.1
# Share of a thing that has to look the same after a turn, and how near that is, metres.
ALIKE, NEAR = 0.8, 0.006
# Points that are compared, and how far off the middle of what was seen the axis may be, metres.
POINTS, OFF = 200, 0.008
# The same of a half turn, and how many axes are refined.
AXES, REFINED = 0.05, 4
# What looks the same after so many of the eight turns that are tried is round, seen from one side.
ROUND = 5


@dataclass(frozen=True, eq=False)
class Matches:
    """Pairs of points, such as the paper's C; several may share the one of the region.

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

    def motions(self, samples: int) -> FloatArray:
        """(H, 4, 4) motions that some matches agree on, from so many triples of them."""
        if not len(self.x):
            return np.zeros((0, 4, 4))
        return sample_motions(self.x, self.y, self.n_x, self.n_y, self.weight, samples=samples)

    def upright(self, target: Target, places: int, turns: int, middles: Sequence[FloatArray]) -> FloatArray:
        """(H, 4, 4) motions, in every turn, to the things that most of the region was matched to.

        Where something is, the matches say long before they say how it is turned.

        Args:
            target: of the query.
            places: how many things at most.
            turns: how often, over a full turn.
            middles: points (3,) of the region that may come to the middle of the thing.
        """
        seeds = [np.zeros((0, 4, 4))]
        if not len(self.x):
            return seeds[0]
        points, labels = target.cloud.points, target.labels
        thing = labels[nearest(self.y, points)[1][:, 0]]
        weights = np.bincount(thing, weights=self.weight, minlength=labels.max() + 1)
        for label in np.argsort(-weights)[:places]:
            w = self.weight * (thing == label)
            if w.sum() > SOME * self.weight.sum():
                x, y = (np.average(points, axis=0, weights=w) for points in (self.x, self.y))
                seeds.append(upright_motions(x, y[None], turns))
                place = middle(points[labels == label])[None]
                seeds += [upright_motions(center, place, turns) for center in middles]
        return np.concatenate(seeds)


@dataclass(frozen=True, eq=False)
class Asked:
    """What a matcher says about one scene.

    Attributes:
        fits: generator -> (4, 4) motion that it proposes before all others.
        matches: pairs of points.
    """

    fits: dict[str, FloatArray]
    matches: Matches


def straightened(T: FloatArray, T_straight: FloatArray, p: FloatArray) -> FloatArray:
    """(4, 4) the motion `T_straight`, carried on to where `T` takes a point (3,)."""
    carried = T_straight.copy()
    carried[:3, 3] += (se3.apply(T, p[None]) - se3.apply(T_straight, p[None]))[0]
    return carried


def upright_motions(center: FloatArray, places: FloatArray, turns: int) -> FloatArray:
    """(P * turns, 4, 4) motions that carry `center` (3,) to places (P, 3), in all upright turns."""
    yaw = np.linspace(0.0, 2 * np.pi, turns, endpoint=False)
    R = np.tile(np.stack([se3.euler(z=float(angle)) for angle in yaw]), (len(places), 1, 1))
    return se3.make(R, np.repeat(places, turns, axis=0) - R @ center)


def equal_turns(cloud: PointCloud) -> FloatArray:
    """(S, 4, 4) turns about the vertical after which a region looks the same; the first is the identity.

    Of round things the networks match any side to any. A lone half turn is not counted: front and back of
    most things look alike from afar, and differ.
    """
    points, center = cloud.points, middle(cloud.points)
    few, found = points[farthest_points(points, POINTS)], []
    for angle in np.radians(np.arange(45.0, 360.0, 45.0)):
        R = se3.euler(z=float(angle))
        motions = np.stack([se3.make(R, center - R @ center + (x, y, 0.0)) for x, y in _around(OFF, 3)])
        alike = onto(few, points, motions)
        if alike.max() > ALIKE:
            found.append((angle, motions[int(np.argmax(alike))]))
    if all(np.isclose(angle, np.pi) for angle, _ in found):
        found = []
    return np.stack([np.eye(4), *(T for _, T in found)])


def all_turns(turns: FloatArray, count: int) -> FloatArray:
    """(count, 4, 4) turns about the axis of equal `turns` (S, 4, 4); the same turns if it is not round."""
    if len(turns) < ROUND:
        return turns
    half = turns[np.argmin(turns[:, 0, 0])]
    axis = np.append(np.linalg.solve(np.eye(2) - half[:2, :2], half[:2, 3]), 0.0)
    return upright_motions(axis, axis[None], count)


def half_turn(points: FloatArray) -> FloatArray:
    """(4, 4) the half turn about the vertical that best lays a thing (N, 3) onto itself.

    Most things look alike from both ends, about an axis that need not go through the middle of what was seen:
    a faucet's goes through its base, whichever way the spout points.
    """
    few, center = points[farthest_points(points, POINTS)], middle(points)
    R = se3.euler(z=np.pi)
    axes = [center + np.array([x, y, 0.0]) for x, y in _around(AXES, 5)]
    motions = np.stack([se3.make(R, axis - R @ axis) for axis in axes])
    best = motions[np.argsort(-onto(few, points, motions), kind="stable")[:REFINED]]
    if len(points) >= 5:
        refine = Refiner(points)
        best = np.stack([*best, *(upright(refine(few, T), center) for T in best)])
    chosen: FloatArray = best[np.argmax(onto(few, points, best))]
    return chosen


def _around(far: float, count: int) -> list[tuple[float, float]]:
    """Offsets in a square grid of `count` rows, up to `far` to each side."""
    side = np.linspace(-far, far, count).tolist()
    return list(product(side, side))


def onto(few: FloatArray, points: FloatArray, motions: FloatArray) -> FloatArray:
    """(H,) share of `few` points that motions (H, 4, 4) carry nearer than `NEAR` to `points`."""
    moved = se3.apply(motions, few)
    distance = nearest(moved.reshape(-1, 3), points)[0].reshape(len(motions), -1)
    share: FloatArray = (distance < NEAR).mean(axis=1)
    return share
