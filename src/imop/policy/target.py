"""What of an observed scene a region may be, prepared once for every candidate in it."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from imop.geometry import se3
from imop.geometry.cloud import PointCloud, facing, inside_box
from imop.geometry.clusters import connected
from imop.geometry.icp import Refiner
from imop.geometry.neighbours import nearest, within
from imop.geometry.perception import viewpoints
from imop.policy.contacts import SAME
from imop.policy.evidence import BESIDE, Surface
from imop.policy.interfaces import Scene
from imop.policy.region import Region
from imop.types import BoolArray, FloatArray


class Target:
    """Points of an observed scene that a region may be.

    Args:
        query: the observed scene.
        cloud: at least `icp.SMALLEST` points of it; with normals, if need be of these alone.

    Attributes:
        query: the observed scene.
        cloud: the points with normals.
        refine: lays regions onto them.
        surface: the points as evidence.
    """

    def __init__(self, query: Scene, cloud: PointCloud) -> None:
        self.query, self.refine = query, Refiner(cloud.points)
        if cloud.normals is None:
            cloud = facing(cloud, self.refine.normals, viewpoints(query.observation))
        self.cloud = cloud
        self.surface = Surface(self.cloud, tuple(query.observation.views.values()))

    @cached_property
    def labels(self) -> NDArray[np.int64]:
        """(N,) number of the connected thing that each point belongs to."""
        return connected(self.cloud.points)

    def places(self, fewest: int = 1) -> FloatArray:
        """(P, 3) the middle of each connected thing that is in focus and has at least so many points."""
        points, labels = self.cloud.points, self.labels
        meant = np.unique(labels[self.query.focused(points, SAME)])
        large = np.intersect1d(np.flatnonzero(np.bincount(labels) >= fewest), meant)
        return np.array([middle(points[labels == label]) for label in large]).reshape(-1, 3)


def middle(points: FloatArray) -> FloatArray:
    """Centre of the bounding box: which side was seen shifts it less than the mean."""
    center: FloatArray = (points.min(axis=0) + points.max(axis=0)) / 2
    return center


def thing_of(points: FloatArray, standing: FloatArray) -> FloatArray:
    """(N, 3) the connected thing among `standing` points (M, 3) that most of `points` are part of."""
    if not len(standing):
        return points
    labels = connected(standing)
    part_of = labels[nearest(points, standing)[1][:, 0]]
    thing: FloatArray = standing[labels == np.bincount(part_of).argmax()]
    return thing


def without_held(cloud: PointCloud, query: Scene, region: Region) -> PointCloud:
    """The part of a query's cloud that is not in the hand, if the region is not what is held."""
    if not len(region.p_gripper_held):
        return cloud
    p_held = se3.apply(query.observation.T_world_gripper, region.p_gripper_held)
    return cloud.select(~within(cloud.points, p_held, SAME))


def around(points: FloatArray, thing: FloatArray, motions: FloatArray) -> BoolArray:
    """(N,) which points (N, 3) have to do with a thing (M, 3) after any of the motions (H, 4, 4)."""
    corners = np.stack(np.meshgrid(*np.stack([thing.min(axis=0), thing.max(axis=0)]).T), axis=-1)
    reached = np.zeros(len(points), dtype=bool)
    for box in se3.apply(motions, corners.reshape(-1, 3)):
        reached |= inside_box(points, box.min(axis=0) - BESIDE, box.max(axis=0) + BESIDE)
    return reached
