"""What the networks see: a thinned cloud, what is known of its points, its neighbours and its coarser grids.

Everything that needs a search happens here, once per cloud and outside the networks, which only gather by
index. Clouds of different sizes make one batch by concatenation: indices then count over the whole batch.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from torch import Tensor

from imop.geometry.cloud import PointCloud, concatenate, farthest_points, grid_cells, voxel_downsample
from imop.geometry.neighbours import nearest
from imop.geometry.perception import Ground, find_ground
from imop.networks.bearings import BEARINGS, bearings
from imop.types import FloatArray

# Statistics of the neighbourhood are taken at these radii, metres.
RADII = (0.03, 0.07)
STATISTICS = 9
# What is lower above the plane, metres, gives no bearing.
LOW = 0.004
LOCAL_FEATURES = 3 + 2 + STATISTICS * len(RADII)
"""Colour, height above the plane, vertical part of the normal, and the local statistics."""
POINT_FEATURES = LOCAL_FEATURES + BEARINGS


@dataclass(frozen=True)
class GraphConfig:
    """How a cloud is thinned and connected.

    Attributes:
        voxel: edge of the finest grid, metres.
        plane_voxel: edge of the grid on the supporting plane, which needs fewer points.
        max_points: cap on the finest level.
        grids: edges of the coarser grids, metres.
        neighbours: K of the kNN graph at every level.
    """

    voxel: float = 0.01
    plane_voxel: float = 0.05
    max_points: int = 640
    grids: tuple[float, ...] = (0.05, 0.12)
    neighbours: int = 8


@dataclass(frozen=True, eq=False)
class Level:
    """Points of one resolution.

    Attributes:
        points: (M, 3) float32, metres.
        normals: (M, 3) float32 unit vectors.
        neighbours: (M, K) int64, nearest first, beginning with the point itself; repeated where there are
            fewer than K.
        cloud: (M,) int64, number of the cloud in the batch.
        parent: (M,) int64 index of the point's cell in the next coarser level; None at the coarsest.
    """

    points: Tensor
    normals: Tensor
    neighbours: Tensor
    cloud: Tensor
    parent: Tensor | None

    def to(self, device: torch.device | str) -> "Level":
        """The same level on a device."""
        parent = None if self.parent is None else self.parent.to(device)
        points, normals, neighbours = (t.to(device) for t in (self.points, self.normals, self.neighbours))
        return Level(points, normals, neighbours, self.cloud.to(device), parent)


@dataclass(frozen=True, eq=False)
class Graph:
    """A batch of clouds, finest level first.

    Attributes:
        levels: one for the finest grid and one for each coarser one.
        features: (M, POINT_FEATURES) float32 of the finest level, unchanged by moves along the table and
            turns about the vertical.
        size: number of clouds.
    """

    levels: tuple[Level, ...]
    features: Tensor
    size: int

    @property
    def points(self) -> Tensor:
        """(M, 3) of the finest level."""
        return self.levels[0].points

    @property
    def cloud(self) -> Tensor:
        """(M,) number of the cloud of each point of the finest level."""
        return self.levels[0].cloud

    def to(self, device: torch.device | str) -> "Graph":
        """The same graph on a device."""
        return Graph(tuple(level.to(device) for level in self.levels), self.features.to(device), self.size)


def build_graph(cloud: PointCloud, config: GraphConfig, ground: Ground | None = None) -> Graph:
    """The graph of one cloud with normals, of at least one point; `ground` of the cloud, if it is known."""
    fine, height = thin(cloud, config, ground)
    assert fine.normals is not None
    points, normals = fine.points, fine.normals
    thing = height > LOW
    features = np.concatenate(
        [
            fine.colors - 0.5,
            np.clip(height, -0.2, 0.8)[:, None] / 0.2,
            normals[:, 2:],
            *(local_statistics(points, normals, radius) for radius in RADII),
            bearings(points, normals, thing if thing.any() else ~thing),
        ],
        axis=1,
    )
    levels = []
    for grid in (*config.grids, None):
        parent, coarse_points, coarse_normals = None, points, normals
        if grid is not None:
            parent, coarse_points, coarse_normals = _pool(points, normals, grid)
        levels.append(_level(points, normals, config.neighbours, parent))
        points, normals = coarse_points, coarse_normals
    return Graph(tuple(levels), torch.from_numpy(features.astype(np.float32)), 1)


def thin(
    cloud: PointCloud, config: GraphConfig, ground: Ground | None = None
) -> tuple[PointCloud, FloatArray]:
    """At most `max_points` of the cloud, few of them bare ground, and their heights (N,) above it.

    Args:
        cloud: with normals.
        config: how densely.
        ground: of the cloud, if it is known.
    """
    ground = ground or find_ground(cloud)
    above = voxel_downsample(cloud.select(~ground.bare), config.voxel)
    below = voxel_downsample(cloud.select(ground.bare), config.plane_voxel)
    # The ground gets at most a third of what there is.
    below = below.select(farthest_points(below.points, config.max_points // 3))
    above = above.select(farthest_points(above.points, config.max_points - len(below)))
    fine = concatenate([above, below])
    return fine, ground.height(fine.points)


def local_statistics(points: FloatArray, normals: FloatArray, radius: float) -> FloatArray:
    """(N, STATISTICS) of each point's neighbourhood; rigid motion changes only the last, the mean rise.

    Number of neighbours; mean and spread of the bend between normals; mean and spread of the rise over the
    tangent plane (convex or hollow); linearity, planarity and scatter of the covariance; mean rise along z.
    """
    n = len(points)
    pairs = cKDTree(points).query_pairs(radius, output_type="ndarray")
    i = np.concatenate([pairs[:, 0], pairs[:, 1]])
    j = np.concatenate([pairs[:, 1], pairs[:, 0]])
    offset = (points[j] - points[i]) / radius
    count = np.bincount(i, minlength=n).astype(np.float64)
    least = np.maximum(count, 1.0)

    def mean(values: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(i, weights=values, minlength=n) / least)

    bend = np.einsum("pk,pk->p", normals[i], normals[j])
    rise = np.einsum("pk,pk->p", normals[i], offset)
    mean_bend, mean_rise = mean(bend), mean(rise)
    center = np.stack([mean(column) for column in offset.T], axis=1)
    second = np.stack([mean(offset[:, a] * offset[:, b]) for a in range(3) for b in range(3)], axis=1)
    covariance = second.reshape(n, 3, 3) - center[:, :, None] * center[:, None, :]
    eigenvalues = np.maximum(np.linalg.eigvalsh(covariance)[:, ::-1], 0.0)
    largest = np.maximum(eigenvalues[:, :1], 1e-9)
    shape = (eigenvalues - np.concatenate([eigenvalues[:, 1:], np.zeros((n, 1))], axis=1)) / largest
    columns = [
        np.log1p(count) / 4.0,
        mean_bend,
        np.sqrt(np.maximum(mean(bend**2) - mean_bend**2, 0.0)),
        mean_rise,
        np.sqrt(np.maximum(mean(rise**2) - mean_rise**2, 0.0)),
        *shape.T,
        mean(offset[:, 2]),
    ]
    return np.stack(columns, axis=1)


def collate(graphs: Sequence[Graph]) -> Graph:
    """One graph of several, their clouds numbered in order."""
    levels = []
    offsets = [
        np.concatenate([[0], np.cumsum([len(g.levels[k].points) for g in graphs])])
        for k in range(len(graphs[0].levels))
    ]
    clouds = np.concatenate([[0], np.cumsum([g.size for g in graphs])])
    for k in range(len(graphs[0].levels)):
        parts = [g.levels[k] for g in graphs]
        parents = [
            part.parent + int(offsets[k + 1][b]) for b, part in enumerate(parts) if part.parent is not None
        ]
        levels.append(
            Level(
                torch.cat([part.points for part in parts]),
                torch.cat([part.normals for part in parts]),
                torch.cat([part.neighbours + int(offsets[k][b]) for b, part in enumerate(parts)]),
                torch.cat([part.cloud + int(clouds[b]) for b, part in enumerate(parts)]),
                torch.cat(parents) if parents else None,
            )
        )
    return Graph(tuple(levels), torch.cat([g.features for g in graphs]), int(clouds[-1]))


def nearest_neighbours(query: FloatArray, points: FloatArray, k: int) -> NDArray[np.int64]:
    """(M, k) indices of the nearest points, nearest first; the last is repeated where there are fewer."""
    found = nearest(query, points, min(k, len(points)))[1]
    missing = k - found.shape[1]
    return np.concatenate([found, np.repeat(found[:, -1:], missing, axis=1)], axis=1)


def _level(points: FloatArray, normals: FloatArray, k: int, parent: NDArray[np.int64] | None) -> Level:
    return Level(
        torch.from_numpy(points.astype(np.float32)),
        torch.from_numpy(normals.astype(np.float32)),
        torch.from_numpy(nearest_neighbours(points, points, k)),
        torch.zeros(len(points), dtype=torch.int64),
        None if parent is None else torch.from_numpy(parent),
    )


def _pool(
    points: FloatArray, normals: FloatArray, grid: float
) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
    """Cell of each point, and the cells' mean points and normals; the grid begins at the lowest corner."""
    cells = np.floor((points - points.min(axis=0)) / grid).astype(np.int64)
    _, parent, counts = grid_cells(cells)

    def mean(values: FloatArray) -> FloatArray:
        return (
            np.stack([np.bincount(parent, weights=column) for column in values.T], axis=1) / counts[:, None]
        )

    coarse_normals = mean(normals)
    coarse_normals /= np.maximum(np.linalg.norm(coarse_normals, axis=1, keepdims=True), 1e-9)
    return parent, mean(points), coarse_normals
