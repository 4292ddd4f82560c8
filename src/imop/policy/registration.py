"""The matcher without learning: descriptors, sampled motions, upright seeds, closest points."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from imop.geometry.cloud import PointCloud, farthest_points, voxel_downsample
from imop.geometry.clusters import find_objects
from imop.geometry.features import fpfh
from imop.geometry.ransac import mutual_matches, sample_motions
from imop.policy.inquiry import Inquiry
from imop.policy.matcher import Hypothesis, Scene, Transition
from imop.policy.region import Region, find_regions
from imop.policy.search import Search, SearchConfig, upright_motions
from imop.policy.things import Things, middle, without_held
from imop.types import FloatArray


@dataclass(frozen=True)
class RegistrationMatcher:
    """Fast point feature histograms, sampled rigid motions and closest points, on clouds without labels.

    Attributes:
        spacing: of the points that get descriptors, metres.
        radius: of a descriptor's neighbourhood, metres.
        color_weight: of colours in the comparison of descriptors.
        turns: upright seeds for every object in the query, spread over a full turn.
        search: how the motions are refined and judged.
        seed: of the sampling.
    """

    spacing: float = 0.01
    radius: float = 0.05
    color_weight: float = 0.2
    turns: int = 24
    search: SearchConfig = field(default_factory=SearchConfig)
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
        self._search = Search(matcher.search, step.before, region)
        self._keypoints, self._descriptors = matcher.describe(region.cloud, 800)

    @property
    def region(self) -> FloatArray:
        """(M, 3) points of the region in the demonstrated scene."""
        return self._region.cloud.points

    def match(self, query: Scene, hints: Sequence[FloatArray] = ()) -> tuple[Hypothesis, ...]:
        """Where the region is in the query, best first; see `PreparedStep.match`."""
        if len(query.cloud) < 5:
            return ()
        standing = without_held(find_objects(query.cloud, query.ground.plane).cloud, query, self._region)
        if len(standing) < 5:
            return ()
        things = Things(query, standing)
        upright = upright_motions(middle(self.region), things.places(), self._matcher.turns)
        seeds = np.concatenate([self._sampled(standing), upright])
        return Inquiry(self._search, things, hints).search(seeds)

    def _sampled(self, things: PointCloud) -> FloatArray:
        """(H, 4, 4) motions from matched descriptors."""
        keypoints, descriptors = self._matcher.describe(things, 2500)
        pairs = mutual_matches(self._descriptors, descriptors)
        x, y = self._keypoints.select(pairs.i_support), keypoints.select(pairs.i_query)
        assert x.normals is not None and y.normals is not None
        seed = self._matcher.seed
        return sample_motions(x.points, y.points, x.normals, y.normals, pairs.weight, seed=seed)
