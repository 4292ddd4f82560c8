"""The matcher without learned matches: regions by rules, point feature histograms, the same search.

Of the networks only the verification is asked. The difference to `learned` measures what the region and
matching networks add.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from imop.geometry.cloud import PointCloud, farthest_points, voxel_downsample
from imop.geometry.features import fpfh
from imop.geometry.ransac import mutual_matches
from imop.networks.model import BUNDLED, load_model
from imop.networks.verification import VerificationNetwork
from imop.policy.interfaces import BEGINNING, Candidate, Feasible, PolicyConfig, Progress, Scene, Transition
from imop.policy.proposals import Asked, Matches
from imop.policy.region import Region, find_regions
from imop.policy.search import StepSearch
from imop.policy.target import obstacles
from imop.policy.verification import Verifier
from imop.types import FloatArray


@dataclass(frozen=True)
class RegistrationMatcher:
    """Fast point feature histograms on clouds without labels.

    Attributes:
        verification: the network that says how likely candidates are right.
        config: of the search.
        spacing: of the points that get descriptors, metres.
        radius: of a descriptor's neighbourhood, metres.
        color_weight: of colours in the comparison of descriptors.
    """

    verification: VerificationNetwork
    config: PolicyConfig = field(default_factory=PolicyConfig)
    spacing: float = 0.01
    radius: float = 0.05
    color_weight: float = 0.2

    @classmethod
    def from_pretrained(cls, weights: Path = BUNDLED) -> "RegistrationMatcher":
        """With the verification network of a folder of weights, by default the bundled one.

        Raises:
            CorruptData: as `networks.model.load_model` does.
        """
        return cls(load_model(weights).verification)

    def prepare(self, steps: Sequence[Transition]) -> list["RegisteredStep"]:
        """Find the regions of a demonstration and describe them."""
        regions = find_regions(steps, self.config)
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
    """A demonstrated step prepared for descriptors."""

    def __init__(self, matcher: RegistrationMatcher, step: Transition, region: Region) -> None:
        self._matcher, self._region = matcher, region
        self._keypoints, self._described = matcher.describe(region.cloud, matcher.config.keypoints[0])
        verifier = Verifier(matcher.verification)
        self.search = StepSearch(matcher.config, step, region, None, verifier, self._ask)

    @property
    def region(self) -> FloatArray:
        """(M, 3) points of the region in the demonstrated scene."""
        return self._region.cloud.points

    @property
    def spread(self) -> None:
        """None: nothing is known of the spread."""
        return None

    def locate(
        self, query: Scene, progress: Progress = BEGINNING, feasible: Feasible | None = None
    ) -> tuple[Candidate, ...]:
        """Where the region may be in the query, likeliest first; see `PreparedStep.locate`."""
        return self.search.locate(query, progress, feasible)

    def _ask(self, query: Scene) -> Asked:
        """Descriptors that choose each other."""
        standing = query.cloud.select(obstacles(query, self._region))
        keypoints, descriptors = self._matcher.describe(standing, self._matcher.config.keypoints[1])
        pairs = mutual_matches(self._described, descriptors)
        x, y = self._keypoints.select(pairs.i_support), keypoints.select(pairs.i_query)
        assert x.normals is not None and y.normals is not None
        return Asked({}, Matches(x.points, x.normals, y.points, y.normals, pairs.weight))
