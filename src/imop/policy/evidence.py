"""How well a moved region explains an observed scene: points, normals, colours and free space."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from imop.geometry import se3
from imop.geometry.cloud import PointCloud
from imop.policy.matcher import Hypothesis
from imop.types import BoolArray, CameraView, Float32Array, FloatArray


def shades(colors: Float32Array) -> FloatArray:
    """Colours (N, 3) of 0 .. 1 as (N, 4) hue and a little brightness: light falls otherwise on a turned face."""
    bright = colors.mean(axis=1, keepdims=True).astype(np.float64)
    return np.concatenate([(colors - bright) / (bright + 0.05), 0.35 * bright], axis=1)


@dataclass(frozen=True)
class Tolerances:
    """What counts as explained.

    Attributes:
        reach: farthest counterpart, metres; about twice the spacing of the pixels on the scene.
        offset: standard deviation of the distance from the counterpart's tangent plane, metres.
        color: standard deviation of the difference of two shades, see `shades`.
        depth: how far behind a point a camera must see to prove it absent, metres.
        hidden: what a point that no camera can see costs, as a share of an unexplained one.
    """

    reach: float = 0.015
    offset: float = 0.005
    color: float = 0.25
    depth: float = 0.02
    hidden: float = 0.5


class Evidence:
    """An observed cloud with normals and the views it came from, ready to judge motions."""

    def __init__(
        self, cloud: PointCloud, views: Mapping[str, CameraView], tolerances: Tolerances | None = None
    ) -> None:
        self.cloud = cloud
        self._views = views
        self._tolerances = tolerances or Tolerances()
        self._tree = cKDTree(cloud.points) if len(cloud) else None
        self._shades = shades(cloud.colors)

    def score(self, region: PointCloud, weight: FloatArray, T_query_support: FloatArray) -> Hypothesis:
        """The motion as a hypothesis: its score is the weighted share of the region that is explained.

        Args:
            region: points of the demonstrated scene with normals.
            weight: (M,) not negative.
            T_query_support: (4, 4).
        """
        points = se3.apply(T_query_support, region.points)
        explained, counterpart = self._explained(points, region, T_query_support)
        tolerance = self._tolerances
        hidden = self._hidden(points, tolerance.depth) & (explained < 0.5)
        possible = weight * np.where(hidden, tolerance.hidden, 1.0)
        score = float((weight * explained).sum() / max(possible.sum(), 1e-9)) if len(points) else 0.0
        good = explained > 0.3
        p_query = self.cloud.points[counterpart[good]]
        return Hypothesis(T_query_support, min(score, 1.0), region.points[good], p_query)

    def _explained(
        self, points: FloatArray, region: PointCloud, T_query_support: FloatArray
    ) -> tuple[FloatArray, NDArray[np.int64]]:
        """(M,) how well the nearest observed point explains each, 0 .. 1, and (M,) its index."""
        assert region.normals is not None and self.cloud.normals is not None
        if self._tree is None:
            return np.zeros(len(points)), np.zeros(len(points), dtype=np.int64)
        distance, index = self._tree.query(points, distance_upper_bound=self._tolerances.reach)
        found = np.isfinite(distance)
        index = np.where(found, index, 0).astype(np.int64)
        normals = self.cloud.normals[index]
        offset = np.einsum("mk,mk->m", normals, points - self.cloud.points[index])
        facing = np.einsum("mk,mk->m", normals, se3.rotate(T_query_support, region.normals))
        color = np.linalg.norm(shades(region.colors) - self._shades[index], axis=1)
        tolerance = self._tolerances
        agreement = np.exp(
            -0.5 * ((offset / tolerance.offset) ** 2 + (color / tolerance.color) ** 2)
        ) * np.clip(facing, 0.0, 1.0)
        return np.where(found, agreement, 0.0), index

    def _hidden(self, points: FloatArray, depth: float) -> BoolArray:
        """(M,) True where something nearer stands before the point in every view that has it in the image."""
        hidden = np.ones(len(points), dtype=bool)
        for view in self._views.values():
            p_camera = se3.apply(se3.invert(view.T_world_camera), points)
            z = p_camera[:, 2]
            in_front = z > 1e-3
            uvw = p_camera @ view.intrinsics.T
            uv = np.round(uvw[:, :2] / np.where(in_front, z, 1.0)[:, None]).astype(np.int64)
            height, width = view.depth.shape
            inside = in_front & np.all((uv >= 0) & (uv < (width, height)), axis=1)
            u, v = np.where(inside[:, None], uv, 0).T
            seen = view.measured[v, u] & (view.depth[v, u] > z - depth)
            hidden &= ~(inside & seen)
        return hidden
