"""Things on the table, told apart by nothing but the gaps between them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from imop.geometry.cloud import PointCloud
from imop.geometry.perception import PLANE_THICKNESS, Plane
from imop.types import FloatArray

# The images resolve 8 mm at arm's length and less on slanted faces; wider gaps part things, metres.
GAP = 0.02


@dataclass(frozen=True, eq=False)
class Objects:
    """What stands on the supporting plane.

    Attributes:
        cloud: the points above the plane.
        labels: (N,) number of the connected cluster of each point.
        height: (N,) metres above the plane; 0 if there is none.
    """

    cloud: PointCloud
    labels: NDArray[np.int64]
    height: FloatArray

    def __len__(self) -> int:
        return len(self.cloud)


def connected(points: FloatArray, gap: float = GAP) -> NDArray[np.int64]:
    """(N,) labels of the connected components when points nearer than `gap` metres are joined."""
    if not len(points):
        return np.zeros(0, dtype=np.int64)
    pairs = cKDTree(points).query_pairs(gap, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(points), len(points)))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def find_objects(cloud: PointCloud, plane: Plane | None, gap: float = GAP, smallest: int = 8) -> Objects:
    """The clusters that remain without the supporting plane; fewer than `smallest` points are specks.

    If nothing remains, the whole cloud is one object: then the plane itself is all there is to go by.
    """
    height = np.zeros(len(cloud)) if plane is None else plane.height(cloud.points)
    standing = height > (-np.inf if plane is None else PLANE_THICKNESS)
    above = cloud.select(standing)
    labels = connected(above.points, gap)
    large = np.bincount(labels)[labels] >= smallest if len(labels) else np.zeros(0, dtype=bool)
    if not large.any():
        return Objects(cloud, np.zeros(len(cloud), dtype=np.int64), height)
    _, renumbered = np.unique(labels[large], return_inverse=True)
    return Objects(above.select(large), renumbered.reshape(-1).astype(np.int64), height[standing][large])
