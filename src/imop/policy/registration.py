"""The matcher without learning: descriptors, sampled motions, upright seeds, closest points."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from imop.geometry import se3
from imop.geometry.cloud import PointCloud, farthest_points, voxel_downsample
from imop.geometry.features import fpfh
from imop.geometry.neighbours import within
from imop.policy.contacts import SAME
from imop.policy.evidence import Judge, Surface
from imop.policy.hypotheses import distinct, mutual_matches, sample_motions
from imop.policy.matcher import Hypothesis, Scene, Transition
from imop.policy.objects import connected, find_objects
from imop.policy.refine import FINEST, Refiner, upright
from imop.policy.region import Region, find_regions
from imop.types import FloatArray

# How many of the refined motions get the finest stage too.
FINISHED = 4
# Things do not lean: a motion that tilts by this angle (radians) or more is as unlikely as any other tilt.
TILTED = 0.17
# Motions nearer to each other than this, metres and radians, are judged once.
SAME_MOTION = (0.001, 0.01)
# Farther off (metres) than this is another place.
ELSEWHERE = 0.03


@dataclass(frozen=True)
class RegistrationMatcher:
    """Fast point feature histograms, sampled rigid motions and closest points, on clouds without labels.

    Attributes:
        spacing: of the points that get descriptors, metres.
        radius: of a descriptor's neighbourhood, metres.
        color_weight: of colours in the comparison of descriptors.
        turns: upright seeds for every object in the query, spread over a full turn.
        refined: how many seeds are refined by closest points.
        turn: share of its score that a hypothesis loses for half a turn off the demonstrated motion.
        tilt: share that it loses for tilting things by `TILTED` or more.
        change: share that it loses for another place than the demonstrated motion leads to.
        seed: of the sampling.
    """

    spacing: float = 0.01
    radius: float = 0.05
    color_weight: float = 0.2
    turns: int = 24
    refined: int = 12
    turn: float = 0.03
    tilt: float = 0.35
    change: float = 0.12
    seed: int = 0

    def prepare(self, steps: Sequence[Transition]) -> list["RegisteredStep"]:
        """Find the regions of a demonstration and describe them."""
        regions = find_regions(steps)
        return [RegisteredStep(self, step, region) for step, region in zip(steps, regions, strict=True)]

    def describe(self, cloud: PointCloud, count: int) -> tuple[PointCloud, FloatArray]:
        """At most `count` points of the cloud and a descriptor (N, 36) of each: shape and colour."""
        sparse = voxel_downsample(cloud, self.spacing)
        assert sparse.normals is not None
        shape = fpfh(sparse.points, sparse.normals, self.radius) / 200.0
        chosen = farthest_points(sparse.points, count)
        described = np.concatenate([shape[chosen], self.color_weight * sparse.colors[chosen]], axis=1)
        return sparse.select(chosen), described


class RegisteredStep:
    """A demonstrated step prepared for registration."""

    def __init__(self, matcher: RegistrationMatcher, step: Transition, region: Region) -> None:
        self._matcher = matcher
        self._region = region
        self._surface = Surface(region.cloud, step.before.observation.views)
        self._center = region.cloud.points.mean(axis=0)
        self._T_world_gripper = step.before.observation.T_world_gripper
        self._keypoints, self._descriptors = matcher.describe(region.cloud, 800)
        self._coarse = region.cloud.points[farthest_points(region.cloud.points, 400)]
        self._fine = region.cloud.points[farthest_points(region.cloud.points, 1500)]

    @property
    def region(self) -> FloatArray:
        """(M, 3) points of the region in the demonstrated scene."""
        return self._region.cloud.points

    def match(self, query: Scene, hints: Sequence[FloatArray] = ()) -> tuple[Hypothesis, ...]:
        """Where the region is in the query, best first; see `PreparedStep.match`."""
        things = self._without_held(query)
        if len(things) < 5:
            return ()
        judge = Judge(self._surface, self._region.weight, Surface(things, query.observation.views))
        T_repeated = query.observation.T_world_gripper @ se3.invert(self._T_world_gripper)
        likely = np.stack([*hints, np.eye(4), T_repeated])
        seeds = np.concatenate([self._sampled(things), self._upright(things)])
        order = np.argsort([-judge.glance(T) for T in seeds], kind="stable")
        chosen = distinct(seeds[order], self._center, keep=self._matcher.refined)
        motions = self._refined(things, judge, likely, seeds[order[chosen]])
        preference = [self._preference(hypothesis, T_repeated, bool(hints)) for hypothesis in motions]
        best_first = [motions[i] for i in np.argsort(-np.asarray(preference), kind="stable")]
        different = distinct(np.stack([h.T_query_support for h in best_first]), self._center, len(best_first))
        return tuple(best_first[i] for i in different)

    def _refined(
        self, things: PointCloud, judge: Judge, likely: FloatArray, seeds: FloatArray
    ) -> list[Hypothesis]:
        """The likely motions as they are, all motions refined, and all of these set upright."""
        refine = Refiner(things.points)
        found = [judge.judge(T) for T in likely]
        found += [judge.judge(refine(self._coarse, T)) for T in [*likely, *seeds]]
        found.sort(key=lambda hypothesis: -hypothesis.score)
        # Many seeds end in the same place.
        motions = np.stack([hypothesis.T_query_support for hypothesis in found])
        found = [found[i] for i in distinct(motions, self._center, len(found), *SAME_MOTION)]
        # The last half millimetre is worth looking for only where it matters.
        finished = [refine(self._fine, h.T_query_support, FINEST) for h in found[:FINISHED]]
        found += [judge.judge(T) for T in finished]
        return found + [judge.judge(upright(h.T_query_support, self._center)) for h in found]

    def _preference(self, hypothesis: Hypothesis, T_repeated: FloatArray, begun: bool) -> float:
        """The score, less for moving otherwise than demonstrated and for tilting what stands on a table.

        Symmetric things have many equal explanations; the one that repeats the demonstrated motion of the
        gripper from where it is now (`T_repeated`) is the easiest to reach and does not twist what is held.
        Among equal things, the one that was approached (if the episode has `begun`) stays the aim.
        """
        T, cost = hypothesis.T_query_support, self._matcher
        turn = float(se3.rotation_distance(T, T_repeated)) / np.pi
        tilt = min(float(np.arccos(np.clip(T[2, 2], -1.0, 1.0))) / TILTED, 1.0)
        p_moved, p_repeated = se3.apply(np.stack([T, T_repeated]), self._center[None])[:, 0]
        away = min(float(np.linalg.norm(p_moved - p_repeated)) / ELSEWHERE, 1.0) if begun else 0.0
        return hypothesis.score * (1 - cost.turn * turn - cost.tilt * tilt - cost.change * away)

    def _without_held(self, query: Scene) -> PointCloud:
        cloud = find_objects(query.cloud).cloud
        if not len(self._region.p_gripper_held):
            return cloud
        p_held = se3.apply(query.observation.T_world_gripper, self._region.p_gripper_held)
        return cloud.select(~within(cloud.points, p_held, SAME))

    def _sampled(self, things: PointCloud) -> FloatArray:
        """(H, 4, 4) motions from matched descriptors."""
        keypoints, descriptors = self._matcher.describe(things, 2500)
        pairs = mutual_matches(self._descriptors, descriptors)
        x, y = self._keypoints.select(pairs.i_support), keypoints.select(pairs.i_query)
        assert x.normals is not None and y.normals is not None
        seed = self._matcher.seed
        return sample_motions(x.points, y.points, x.normals, y.normals, pairs.weight, seed=seed)

    def _upright(self, things: PointCloud) -> FloatArray:
        """(H, 4, 4) motions that set the region on the place of every object of the query, in every turn."""
        labels = connected(things.points)
        places = [_middle(things.points[labels == label]) for label in range(labels.max() + 1)]
        turns = np.linspace(0.0, 2 * np.pi, self._matcher.turns, endpoint=False)
        return np.stack(list(_about(_middle(self.region), places, turns)))


def _middle(points: FloatArray) -> FloatArray:
    """Centre of the bounding box: which side was seen shifts it less than the mean."""
    middle: FloatArray = (points.min(axis=0) + points.max(axis=0)) / 2
    return middle


def _about(center: FloatArray, places: Iterable[FloatArray], turns: FloatArray) -> Iterable[FloatArray]:
    for place in places:
        for turn in turns:
            R = se3.euler(z=float(turn))
            yield se3.make(R, place - R @ center)
