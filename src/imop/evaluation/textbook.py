"""The textbook: descriptors, RANSAC and closest points as Open3D has them, with the values of its tutorial.

What one would write without imop, given its regions. Unlike `registration.py` it has no search of our own: no
upright seeds, no colours, no free space, no second answer, no memory of the step before.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from imop.errors import MissingExtra
from imop.geometry.cloud import PointCloud
from imop.policy.interfaces import BEGINNING, Candidate, Feasible, PolicyConfig, Progress, Scene, Transition
from imop.policy.region import Region, find_regions
from imop.policy.target import obstacles
from imop.types import FloatArray

# Neighbours within `radius` that a descriptor looks at, at most.
_NEIGHBOURS = 100
# Of the edges of a triple, the shorter must be at least this share of the longer.
_EDGES = 0.9


@dataclass(frozen=True)
class TextbookMatcher:
    """FPFH + RANSAC + ICP by Open3D, on what stands on the table.

    Attributes:
        spacing: of the points that get descriptors, metres; RANSAC takes pairs nearer than 1.5 times this.
        radius: of a descriptor's neighbourhood, metres.
        iterations: of RANSAC at most.
        closest: largest distance of a pair in the refinement, metres.
        seed: of RANSAC.

    Raises:
        MissingExtra: if Open3D is not installed or does not find its system libraries.
    """

    spacing: float = 0.01
    radius: float = 0.05
    iterations: int = 100_000
    closest: float = 0.01
    seed: int = 0

    def __post_init__(self) -> None:
        _open3d()

    def prepare(self, steps: Sequence[Transition]) -> list["TextbookStep"]:
        """Find the regions of a demonstration and describe them."""
        regions = find_regions(steps, PolicyConfig())
        return [TextbookStep(self, region) for region in regions]

    def describe(self, cloud: PointCloud) -> tuple[Any, Any]:
        """Open3D's thinned cloud and its descriptors."""
        o3d = _open3d()
        sparse = _cloud(cloud).voxel_down_sample(self.spacing)
        around = o3d.geometry.KDTreeSearchParamHybrid(self.radius, _NEIGHBOURS)
        return sparse, o3d.pipelines.registration.compute_fpfh_feature(sparse, around)

    def register(self, source: tuple[Any, Any], target: tuple[Any, Any]) -> FloatArray:
        """(4, 4) the motion that most descriptors agree on."""
        found = _open3d().pipelines.registration
        reach = 1.5 * self.spacing
        result = found.registration_ransac_based_on_feature_matching(
            source[0],
            target[0],
            source[1],
            target[1],
            True,
            reach,
            found.TransformationEstimationPointToPoint(False),
            3,
            [
                found.CorrespondenceCheckerBasedOnEdgeLength(_EDGES),
                found.CorrespondenceCheckerBasedOnDistance(reach),
            ],
            found.RANSACConvergenceCriteria(self.iterations, 0.999),
        )
        return np.array(result.transformation)

    def refine(self, source: PointCloud, target: PointCloud, T: FloatArray) -> Candidate:
        """The motion (4, 4) after closest points; its fitness stands for the probability."""
        found = _open3d().pipelines.registration
        plane = found.TransformationEstimationPointToPlane()
        result = found.registration_icp(_cloud(source), _cloud(target), self.closest, T, plane)
        i_support, i_query = np.asarray(result.correspondence_set).reshape(-1, 2).T
        return Candidate(
            np.array(result.transformation),
            float(result.fitness),
            source.points[i_support],
            target.points[i_query],
        )


class TextbookStep:
    """A demonstrated step prepared for registration."""

    def __init__(self, matcher: TextbookMatcher, region: Region) -> None:
        self._matcher, self._region = matcher, region
        self._described = matcher.describe(region.cloud)

    @property
    def region(self) -> FloatArray:
        """(M, 3) points of the region in the demonstrated scene."""
        return self._region.cloud.points

    @property
    def spread(self) -> None:
        """Nothing is known of it."""
        return None

    def locate(
        self, query: Scene, progress: Progress = BEGINNING, feasible: Feasible | None = None
    ) -> tuple[Candidate, ...]:
        """Where the region is in the query: one answer, by what is seen alone. See `PreparedStep.locate`."""
        if len(query.cloud) < 5:
            return ()
        things = query.cloud.select(obstacles(query, self._region))
        if len(things) < 5:
            return ()
        _open3d().utility.random.seed(self._matcher.seed)
        T = self._matcher.register(self._described, self._matcher.describe(things))
        return (self._matcher.refine(self._region.cloud, things, T),)


def _open3d() -> Any:
    try:
        import open3d
    except (ImportError, OSError) as error:
        raise MissingExtra("open3d", "baselines") from error
    return open3d


def _cloud(cloud: PointCloud) -> Any:
    o3d = _open3d()
    assert cloud.normals is not None
    made = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.points))
    made.normals = o3d.utility.Vector3dVector(cloud.normals)
    return made
