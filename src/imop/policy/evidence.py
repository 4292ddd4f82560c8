"""How well a moved region explains an observed scene: points, normals, colours and free space."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from imop.geometry import se3
from imop.geometry.cloud import PointCloud, concatenate, farthest_points, project
from imop.policy.matcher import Hypothesis
from imop.policy.region import Region
from imop.types import BoolArray, CameraView, Float32Array, FloatArray


@dataclass(frozen=True)
class Tolerances:
    """What counts as explained.

    Attributes:
        reach: farthest counterpart, metres; about twice the spacing of the pixels on the scene.
        offset: standard deviation of the distance from the counterpart's tangent plane, metres.
        along: the same along that plane, metres; it tells where a face ends.
        shade: standard deviation of the difference of two shades, see `shades`.
        depth: how far behind a point a camera must see to prove it absent, metres.
        behind: what a counterpart counts that faces the other way: thin walls are seen from either side, and
            where both sides fall into one voxel its normal is that of one of them. Nothing solid is turned
            inside out by a motion, so little is lost.
        grazing: cosine of the angle to its normal from which a camera sees a face at all.
        hidden: what a point that no camera can see costs, as a share of an unexplained one.
        absent: the same of a point of a firm region that a camera sees through, with nothing around it.
        around: observed points this near to the moved region have to be explained by it, metres.
        backward: share of the score that these points decide.
        context: share of the forward score that the region's surroundings decide.
    """

    reach: float = 0.015
    offset: float = 0.005
    along: float = 0.008
    shade: float = 0.25
    depth: float = 0.02
    behind: float = 0.9
    grazing: float = 0.25
    hidden: float = 0.5
    absent: float = 3.0
    around: float = 0.04
    backward: float = 0.25
    context: float = 0.3


def shades(colors: Float32Array) -> FloatArray:
    """Colours (N, 3) of 0 .. 1 as (N, 4) hue and a little brightness, for light changes with a turn."""
    bright = colors.mean(axis=1, keepdims=True).astype(np.float64)
    return np.concatenate([(colors - bright) / (bright + 0.05), 0.35 * bright], axis=1)


class Surface:
    """What was observed of a scene or of a part of it: a cloud with normals and the views it came from."""

    def __init__(
        self, cloud: PointCloud, views: Sequence[CameraView], tolerances: Tolerances | None = None
    ) -> None:
        self.cloud = cloud
        self.tolerances = tolerances or Tolerances()
        self._views = views
        self._tree = cKDTree(cloud.points) if len(cloud) else None
        self._shades = shades(cloud.colors)

    def explain(self, cloud: PointCloud, T: FloatArray) -> tuple[FloatArray, NDArray[np.int64]]:
        """(M,) how well this surface explains points of a `cloud` with normals moved by `T`, 0 .. 1.

        And (M,) the indices of the counterparts.
        """
        assert cloud.normals is not None and self.cloud.normals is not None
        if self._tree is None:
            return np.zeros(len(cloud)), np.zeros(len(cloud), dtype=np.int64)
        points = se3.apply(T, cloud.points)
        distance, index = self._tree.query(points, distance_upper_bound=self.tolerances.reach)
        found = np.isfinite(distance)
        index = np.where(found, index, 0).astype(np.int64)
        normals = self.cloud.normals[index]
        offset = np.einsum("mk,mk->m", normals, points - self.cloud.points[index])
        facing = np.einsum("mk,mk->m", normals, se3.rotate(T, cloud.normals))
        shade = np.linalg.norm(shades(cloud.colors) - self._shades[index], axis=1)
        along = np.sqrt(np.maximum(np.where(found, distance, 0.0) ** 2 - offset**2, 0.0))
        tolerances = self.tolerances
        error = (offset / tolerances.offset) ** 2 + (shade / tolerances.shade) ** 2
        error += (along / tolerances.along) ** 2
        facing = np.clip(np.where(facing < 0, -tolerances.behind * facing, facing), 0.0, 1.0)
        agreement = np.where(found, np.exp(-0.5 * error) * facing, 0.0)
        return agreement, index

    def colorless(self) -> "Surface":
        """The same shape, all of one colour."""
        return Surface(self.cloud.colorless(), self._views, self.tolerances)

    @cached_property
    def sample(self) -> PointCloud:
        """At most 1000 of the points, evenly spread."""
        return self.cloud.select(farthest_points(self.cloud.points, 1000))

    def near(self, points: FloatArray) -> BoolArray:
        """(M,) True for points around this surface."""
        if self._tree is None:
            return np.zeros(len(points), dtype=bool)
        distance, _ = self._tree.query(points, distance_upper_bound=self.tolerances.around)
        return np.isfinite(distance)

    def seen(self, points: FloatArray, normals: FloatArray) -> tuple[BoolArray, BoolArray]:
        """(M,) True where no view can say that a face at the point, with its normal, is not there.

        A view can if the face lies in its image and turns to it, and nothing nearer stands before it. And
        (M,) True where a view sees through the point to what is farther away.
        """
        return seen(self._views, points, normals, self.tolerances.depth, self.tolerances.grazing)

    def possible(
        self, cloud: PointCloud, weight: FloatArray, explained: FloatArray, firm: BoolArray | None = None
    ) -> FloatArray:
        """(M,) weights of a `cloud` with normals after what was `explained` (M,) of it.

        Unexplained points that are hidden count less; of the `firm` ones, (M,), which cannot have moved on
        their own, those that are seen to be absent count more.
        """
        open_points = np.flatnonzero(explained < 0.5)
        doubtful = cloud.select(open_points)
        assert doubtful.normals is not None
        hidden, through = self.seen(doubtful.points, doubtful.normals)
        possible = weight.copy()
        possible[open_points[hidden]] *= self.tolerances.hidden
        if firm is not None:
            absent = through & firm[open_points] & (explained[open_points] == 0.0)
            possible[open_points[absent]] *= self.tolerances.absent
        return possible

    def share(
        self,
        cloud: PointCloud,
        weight: FloatArray,
        T: FloatArray,
        explained: FloatArray,
        firm: BoolArray | None = None,
    ) -> float:
        """Weighted share 0 .. 1 of the moved `cloud` that is `explained` (M,); see `possible`."""
        possible = self.possible(moved(cloud, T), weight, explained, firm)
        return float(np.clip((weight * explained).sum() / max(possible.sum(), 1e-9), 0.0, 1.0))


def seen(
    views: Sequence[CameraView], points: FloatArray, normals: FloatArray, behind: float, grazing: float
) -> tuple[BoolArray, BoolArray]:
    """What views say of faces at points (M, 3) with normals (M, 3); see `Surface.seen`.

    Args:
        views: of the scene.
        points: world frame, metres.
        normals: of the faces.
        behind: how far behind a point a camera must see to prove it absent, metres.
        grazing: cosine of the angle to its normal from which a camera sees a face.
    """
    hidden, through = np.ones(len(points), dtype=bool), np.zeros(len(points), dtype=bool)
    for view in views:
        to_camera = view.T_world_camera[:3, 3] - points
        distance = np.maximum(np.linalg.norm(to_camera, axis=1), 1e-9)
        slant = np.einsum("mk,mk->m", to_camera, normals) / distance
        (column, row), z, inside = (part.T for part in project(view, points))
        depth = view.depth[row, column]
        beyond = np.where(inside & np.isfinite(depth), depth - z, -np.inf)
        hidden &= ~((beyond > -behind) & (slant > grazing))
        through |= beyond > behind
    return hidden, through


def moved(cloud: PointCloud, T: FloatArray) -> PointCloud:
    """A cloud with normals after a motion (4, 4), or after each of several (H, 4, 4), one after the other."""
    assert cloud.normals is not None
    copies = int(np.prod(T.shape[:-2]))
    return PointCloud(
        se3.apply(T, cloud.points).reshape(-1, 3),
        np.tile(cloud.colors, (copies, 1)),
        np.tile(cloud.camera, copies),
        se3.rotate(T, cloud.normals).reshape(-1, 3),
    )


class Template:
    """A region ready to be judged in any query: everything that only depends on the demonstration.

    Args:
        region: of a step.
        views: of the demonstrated scene.
    """

    def __init__(self, region: Region, views: Sequence[CameraView]) -> None:
        self.surface = Surface(region.cloud, views)
        self.whole = self.surface if region.context is None else Surface(region.whole, views)
        self.coarse, self.coarse_weight, coarse_size = self._points(region, 120)
        self.fine, self.fine_weight, self.size = self._points(region, 1000)
        # The points beyond these are of the context, which may have moved on its own.
        self.coarse_firm = region.firm & (np.arange(len(self.coarse)) < coarse_size)
        self.fine_firm = region.firm & (np.arange(len(self.fine)) < self.size)

    def _points(self, region: Region, count: int) -> tuple[PointCloud, FloatArray, int]:
        """At most `count` points of the region, then half as many of its context; their weights.

        And how many of them are of the region.
        """
        chosen = farthest_points(region.cloud.points, count)
        cloud, weight = region.cloud.select(chosen), region.weight[chosen]
        if region.context is None:
            return cloud, weight, len(chosen)
        near = region.context.select(farthest_points(region.context.points, count // 2))
        share = self.surface.tolerances.context
        each = share / (1 - share) * weight.sum() / len(near)
        return concatenate([cloud, near]), np.concatenate([weight, np.full(len(near), each)]), len(chosen)


class Judge:
    """Scores motions of one region into one query, in both directions.

    Forward, the observed points have to explain the moved region; backward, the region has to explain what
    was observed around it, which tells a thing from a larger one and a front with handles from a back.

    Args:
        template: of the region.
        query: the observed scene.
    """

    def __init__(self, template: Template, query: Surface) -> None:
        self._template, self._query = template, query

    def glance(self, T_query_support: FloatArray) -> FloatArray:
        """(H,) quick forward scores, 0 .. 1, of motions (H, 4, 4)."""
        copies = moved(self._template.coarse, T_query_support)
        weight = np.tile(self._template.coarse_weight, len(T_query_support))
        explained, _ = self._query.explain(copies, np.eye(4))
        firm = np.tile(self._template.coarse_firm, len(T_query_support))
        possible = self._query.possible(copies, weight, explained, firm)
        got, wanted = ((v.reshape(len(T_query_support), -1)).sum(1) for v in (weight * explained, possible))
        scores: FloatArray = np.clip(got / np.maximum(wanted, 1e-9), 0.0, 1.0)
        return scores

    def judge(self, T_query_support: FloatArray) -> Hypothesis:
        """The motion as a hypothesis, scored in both directions."""
        template, fine = self._template, self._template.fine
        explained, counterpart = self._query.explain(fine, T_query_support)
        forward = self._query.share(
            fine, template.fine_weight, T_query_support, explained, template.fine_firm
        )
        part = self._query.tolerances.backward
        score = (1 - part) * forward + part * self._backward(se3.invert(T_query_support))
        good = np.flatnonzero(explained[: template.size] > 0.3)
        p_query = self._query.cloud.points[counterpart[good]]
        return Hypothesis(T_query_support, score, fine.points[good], p_query)

    def in_view(self, T_query_support: FloatArray) -> float:
        """Share 0 .. 1 of the moved region, without context or what is hidden, that is explained."""
        size, weight = self._template.size, self._template.fine_weight[: self._template.size]
        own = moved(self._template.fine.select(np.arange(size)), T_query_support)
        assert own.normals is not None
        explained, _ = self._query.explain(own, np.eye(4))
        hidden, _ = self._query.seen(own.points, own.normals)
        got = weight * explained
        missing = weight * (1 - explained) * ~hidden
        return float(got.sum() / max((got + missing).sum(), 1e-9))

    def _backward(self, T_support_query: FloatArray) -> float:
        sample = self._query.sample
        around = sample.select(self._template.surface.near(se3.apply(T_support_query, sample.points)))
        explained, _ = self._template.whole.explain(around, T_support_query)
        return self._template.whole.share(around, np.ones(len(around)), T_support_query, explained)
