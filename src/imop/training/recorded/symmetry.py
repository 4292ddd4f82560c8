"""Motions of a region that are as right as the demonstrated one: turns of symmetric things, equal things.

Nobody says what is symmetric. A turn, or another place, is as right if what all demonstrations saw of the
region, moved there, looks like the query: its points are observed in their colours or hidden, and it covers
the objects that it stands for.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm, logm
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from imop.demos.regions import BACKGROUND
from imop.geometry import se3
from imop.geometry.cloud import PointCloud, project
from imop.geometry.neighbours import nearest
from imop.types import BoolArray, FloatArray, Observation

TURNS = 12
_FINER = 6
"""So many steps are made of one turn of what is round."""
_NEAR = 0.007
"""An observed point this near explains a moved one, metres: a pixel covers that much."""
_NEIGHBOURS = 4
_BEHIND = 0.01
"""A camera that sees this much behind a point, metres, proves it absent."""
_HUE, _SHADE = 0.35, 1.8
"""How far hues may differ, and by which factor brightness may: light changes with a turn."""
_REFUTED = 0.04
"""Share of the points that may be refuted beyond those that are where the region really stands."""
_OBSERVED = 0.5
"""Share that must be observed of what is observed where the region really stands."""
_UNCOVERED = 0.06
"""Share of an object's points that the moved region may leave uncovered."""
_OVERLAP = 0.2
"""Share that must be observed in any turn, of what is observed where the region really stands."""
_TOUCHED = 0.1
"""An object with this share of the observed points is one that the region stands for."""
_POINTS = 400
"""So many points are judged at most."""
_SAME_PLACE, _SAME_TURN = 0.004, np.radians(3.0)


@dataclass(frozen=True, eq=False)
class ColoredPoints:
    """Points (N, 3) and their colours (N, 3), 0 .. 1, in any one frame."""

    points: FloatArray
    colors: FloatArray

    @classmethod
    def pooled(cls, parts: Iterable[tuple[PointCloud, FloatArray]]) -> "ColoredPoints":
        """In the action's frame, of clouds and their action poses T_world_goal."""
        points, colors = [], []
        for cloud, T_world_goal in parts:
            points.append(se3.apply(se3.invert(T_world_goal), cloud.points))
            colors.append(cloud.colors.astype(np.float64))
        return cls(np.concatenate(points), np.concatenate(colors))

    def thinned(self) -> "ColoredPoints":
        """Every so many points, at most about `_POINTS`."""
        step = 1 + len(self.points) // _POINTS
        return ColoredPoints(self.points[::step], self.colors[::step])


class ObservedCloud:
    """What was seen of a state: a cloud with instance ids, and depth images that say where nothing is."""

    def __init__(self, cloud: PointCloud, observation: Observation):
        assert cloud.ids is not None and observation.instance_names is not None
        self._points, self._colors = cloud.points, cloud.colors.astype(np.float64)
        self._tree = cKDTree(cloud.points)
        names = observation.instance_names
        objects = [i for i, name in names.items() if name not in BACKGROUND]
        self._object = np.where(np.isin(cloud.ids, objects), cloud.ids, 0)
        self._views = tuple(observation.views.values())

    def judge(self, surface: ColoredPoints, T: FloatArray) -> tuple[float, float]:
        """Shares of the surface's points that, if it stood at `T` (4, 4), are refuted, and are observed.

        Observed is what has a point of its colour beside it. Refuted is what has only points of other
        colours beside it, or what a camera sees through. The rest is hidden.
        """
        points = se3.apply(T, surface.points)
        observed, touching = self._observed(points, surface.colors)
        alone = touching < 0
        refuted = ~observed & ~alone
        refuted[alone] = self.seen_through(points[alone])
        return float(refuted.mean()), float(observed.mean())

    def uncovered(self, surface: ColoredPoints, T: FloatArray) -> float:
        """Share of the points of the objects where the surface would stand that it does not explain."""
        points = se3.apply(T, surface.points)
        observed, touching = self._observed(points, surface.colors)
        touched = self._object[touching[observed]]
        ids, counts = np.unique(touched[touched > 0], return_counts=True)
        mine = np.isin(self._object, ids[counts > _TOUCHED * observed.sum()])
        if not mine.any():
            return 1.0
        distance, index = nearest(self._points[mine], points, min(_NEIGHBOURS, len(points)))
        alike = _alike(self._colors[mine][:, None], surface.colors[index])
        return float(1 - ((distance < _NEAR) & alike).any(axis=1).mean())

    def _observed(self, points: FloatArray, colors: FloatArray) -> tuple[BoolArray, NDArray[np.int64]]:
        """(N,) whether a point of that colour is beside it; (N,) the nearest point beside it, or -1."""
        _, index = self._tree.query(points, k=_NEIGHBOURS, distance_upper_bound=_NEAR)
        index = np.asarray(index)
        near: BoolArray = index < len(self._points)
        index = np.where(near, index, 0)
        observed = np.any(near & _alike(colors[:, None], self._colors[index]), axis=1)
        return np.asarray(observed), np.where(near[:, 0], index[:, 0], -1)

    def seen_through(self, points: FloatArray) -> BoolArray:
        """(N,) True where a camera measured something well behind a point (N, 3), world frame."""
        through = np.zeros(len(points), dtype=bool)
        for view in self._views:
            (column, row), z, inside = (part.T for part in project(view, points))
            through |= inside & view.measured[row, column] & (view.depth[row, column] > z + _BEHIND)
        return through


def equal_motions(
    surface: ColoredPoints,
    query: ObservedCloud,
    T_support_goal: FloatArray,
    T_query_goal: FloatArray,
    others: Sequence[FloatArray] = (),
) -> FloatArray:
    """(S, 4, 4) motions of the region from the support to the query, the demonstrated one first.

    Tried are turns about the vertical through the region's middle, and the places that the same region
    would have if one of `others` were the action.

    Args:
        surface: of the region in the action's frame.
        query: s_j.
        T_support_goal: (4, 4) T_i.
        T_query_goal: (4, 4) T_j.
        others: (4, 4) actions of other steps of the query's demonstration: what they are fixed to may be
            equal to the region.
    """
    vertical = se3.rotate(se3.invert(T_support_goal), np.array([[0.0, 0.0, 1.0]]))[0]
    few = surface.thinned()
    usual, visible = query.judge(few, T_query_goal)
    found: list[FloatArray] = [T_query_goal]
    turns = turns_about(few.points, vertical)
    # Compact things overlap with themselves however they are turned, so most places are out at once.
    places = [T for T in others if query.judge(few, T)[1] > _OVERLAP * visible]
    for T in (goal @ turn for goal in (T_query_goal, *places) for turn in turns):
        if se3.near(np.stack(found), T, _SAME_PLACE, _SAME_TURN).any():
            continue
        refuted, observed = query.judge(few, T)
        if refuted > usual + _REFUTED or observed < _OBSERVED * visible:
            continue
        if query.uncovered(surface, T) < _UNCOVERED:
            found.append(T)
    return np.stack(found) @ se3.invert(T_support_goal)


def between_turns(motions: FloatArray) -> FloatArray:
    """(S', 4, 4) motions (S, 4, 4) of `equal_motions`, and those between two that are one turn apart.

    What looks the same after one of `TURNS` is round. Between the two, there is one every 5 degrees.
    """
    shares = np.arange(1, _FINER)[:, None, None] / _FINER
    found = [motions]
    for A in motions:
        turns = se3.invert(A) @ motions
        one = np.isclose(se3.rotation_distance(turns, np.eye(4)), 2 * np.pi / TURNS, atol=_SAME_TURN)
        # Of a turn and its reverse, which is the same of the other motion, one is enough.
        found += [A @ expm(shares * logm(turn)).real for turn in turns[one & (turns[:, 1, 0] > 0)]]
    return np.concatenate(found)


def turns_about(points: FloatArray, axis: FloatArray) -> FloatArray:
    """(TURNS, 4, 4) turns about the line along `axis` (3,) that is in the middle of `points` (N, 3).

    The line is put where half a turn carries the points onto themselves as well as it can.
    """
    R = _rotation(axis, np.pi)
    across = np.eye(3) - np.outer(axis, axis)
    flat = points @ across
    center: FloatArray = (flat.min(axis=0) + flat.max(axis=0)) / 2
    for _ in range(10):
        turned = (points - center) @ R.T + center
        distance, index = (found[:, 0] for found in nearest(turned, points))
        near = distance < 0.02
        if not near.any():
            break
        # A half-turn about a line that is off by d carries points 2 d off.
        center = center + across @ (points[index[near]] - turned[near]).mean(axis=0) / 2
    angles = 2 * np.pi * np.arange(TURNS) / TURNS
    turns = np.stack([_rotation(axis, float(angle)) for angle in angles])
    return se3.make(turns, center - turns @ center)


def _rotation(axis: FloatArray, angle: float) -> FloatArray:
    return np.asarray(Rotation.from_rotvec(angle * axis).as_matrix())


def _alike(a: FloatArray, b: FloatArray) -> BoolArray:
    """Whether colours (..., 3) may be the same in another light."""
    bright_a, bright_b = (c.mean(axis=-1, keepdims=True) + 0.05 for c in (a, b))
    hue = np.abs(a / bright_a - b / bright_b).max(axis=-1)
    return np.asarray((hue < _HUE) & (np.abs(np.log(bright_a / bright_b))[..., 0] < np.log(_SHADE)))
