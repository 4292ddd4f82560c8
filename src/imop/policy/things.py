"""What of an observed scene a region may be, prepared once for every search in it."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from imop.geometry import se3
from imop.geometry.cloud import PointCloud, facing
from imop.geometry.clusters import connected
from imop.geometry.icp import SMALLEST, Refiner
from imop.geometry.neighbours import nearest, within
from imop.geometry.perception import viewpoints
from imop.policy.contacts import SAME
from imop.policy.evidence import Surface, shades
from imop.policy.matcher import Scene
from imop.policy.region import Region
from imop.types import BoolArray, FloatArray

# A point belongs to a surface that explains it as well as this.
EXPLAINED = 0.2

# Shades (see `evidence.shades`) nearer to each other than this are of one colour.
LIKE = 0.1


class Standing:
    """Points of an observed scene that a region may be.

    Attributes:
        query: the observed scene.
        cloud: at least 5 points of it; with normals, if need be of these alone.
        refine: lays regions onto them.
    """

    def __init__(self, query: Scene, cloud: PointCloud) -> None:
        self.query, self.refine = query, Refiner(cloud.points)
        if cloud.normals is None:
            cloud = facing(cloud, self.refine.normals, viewpoints(query.observation))
        self.cloud = cloud

    @cached_property
    def labels(self) -> NDArray[np.int64]:
        """(N,) number of the connected thing that each point belongs to."""
        return connected(self.cloud.points)

    def places(self, fewest: int = 1) -> FloatArray:
        """(P, 3) the middle of each connected thing of at least so many points."""
        points, labels = self.cloud.points, self.labels
        large = np.flatnonzero(np.bincount(labels) >= fewest)
        return np.array([middle(points[labels == label]) for label in large]).reshape(-1, 3)


class Things(Standing):
    """The same, to be searched.

    Attributes:
        surface: the points as evidence.
    """

    def __init__(self, query: Scene, cloud: PointCloud) -> None:
        super().__init__(query, cloud)
        self.surface = Surface(self.cloud, tuple(query.observation.views.values()))

    def colored_like(self, cloud: PointCloud) -> BoolArray:
        """(N,) which points have a colour that occurs in a cloud."""
        if not len(cloud):
            return np.zeros(len(self.cloud), dtype=bool)
        away, _ = nearest(shades(self.cloud.colors), shades(cloud.colors))
        return np.asarray(away[:, 0] < LIKE)

    def colorless(self) -> "Things":
        """The same without colours."""
        return Things(self.query, self.cloud.colorless())

    def unexplained(self, by: Surface, T_query_support: FloatArray) -> "Things | None":
        """What a moved surface leaves to be explained; None if that is next to nothing."""
        cloud = self.cloud
        left = by.explain(cloud, se3.invert(T_query_support))[0] < EXPLAINED
        return Things(self.query, cloud.select(left)) if left.sum() >= SMALLEST else None


def middle(points: FloatArray) -> FloatArray:
    """Centre of the bounding box: which side was seen shifts it less than the mean."""
    center: FloatArray = (points.min(axis=0) + points.max(axis=0)) / 2
    return center


def without_held(cloud: PointCloud, query: Scene, region: Region) -> PointCloud:
    """The part of a query's cloud that is not in the hand, if the region is not what is held."""
    if not len(region.p_gripper_held):
        return cloud
    p_held = se3.apply(query.observation.T_world_gripper, region.p_gripper_held)
    return cloud.select(~within(cloud.points, p_held, SAME))
