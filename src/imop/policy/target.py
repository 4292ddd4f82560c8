"""What was observed of a scene, and what of it a region may be; prepared once for every candidate in it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from imop.geometry import se3
from imop.geometry.cloud import PointCloud, facing, inside_box, middle, project
from imop.geometry.clusters import connected
from imop.geometry.icp import Refiner
from imop.geometry.neighbours import nearest, within
from imop.geometry.perception import viewpoints
from imop.policy.contacts import SAME
from imop.policy.interfaces import PolicyConfig, Scene, Transition
from imop.policy.region import NEXT, Goal, Region, fading
from imop.types import BoolArray, CameraView, Float32Array, FloatArray

# Farthest counterpart, metres.
REACH = 0.06
# Standard deviations of what is explained exactly: off the counterpart's tangent plane and along it, metres.
OFFSET, ALONG = 0.005, 0.008
# Standard deviation of the difference of two shades of one colour; see `shades`.
SHADE = 0.25
# What a counterpart counts that faces the other way: thin walls are seen from either side.
BEHIND = 0.9
# A camera sees a face from this cosine of the angle to its normal on, and must see this far (metres) behind
# a point to prove it absent.
GRAZING, THROUGH = 0.25, 0.02
# What is farther than this (metres) from where the gripper goes has nothing to say about it.
BESIDE = 0.08


@dataclass(frozen=True, eq=False)
class Explained:
    """How well a surface explains K points.

    Attributes:
        exact: (K,) 0 .. 1, as if the thing were the same.
        loose: (K,) 0 .. 1, with the spread that each point is allowed.
        color: (K,) 0 .. 1, agreement of the colours; 0 where there is no counterpart.
        index: (K,) the counterparts.
    """

    exact: FloatArray
    loose: FloatArray
    color: FloatArray
    index: NDArray[np.int64]


class Surface:
    """What was observed of a scene or of a part of it.

    Args:
        cloud: at least one point, with normals.
        views: that it was seen in.

    Attributes:
        cloud: the same.
        tree: of its points.
        shades: (N, 4) of its colours.
        sample: indices of about a thousand of its points.
    """

    def __init__(self, cloud: PointCloud, views: Sequence[CameraView]) -> None:
        self.cloud, self._views = cloud, views
        self.tree = cKDTree(cloud.points)
        self.shades = shades(cloud.colors)
        # The grid has spread the points evenly already.
        self.sample = np.arange(0, len(cloud), max(1, len(cloud) // 1000))

    def explain(
        self, points: FloatArray, normals: FloatArray, hue: FloatArray, spread: FloatArray
    ) -> Explained:
        """How well this explains points (K, 3) with normals (K, 3), shades (K, 4) and a spread (K,)."""
        assert self.cloud.normals is not None
        distance, index = self.tree.query(points, distance_upper_bound=REACH)
        found = np.isfinite(distance)
        index = np.where(found, index, 0).astype(np.int64)
        n = self.cloud.normals[index]
        offset = np.einsum("mk,mk->m", n, points - self.cloud.points[index]) ** 2
        along = np.maximum(np.where(found, distance, 0.0) ** 2 - offset, 0.0)
        facing = np.einsum("mk,mk->m", n, normals)
        facing = np.where(found, np.clip(np.where(facing < 0, -BEHIND * facing, facing), 0.0, 1.0), 0.0)
        exact = facing * np.exp(-0.5 * (offset / OFFSET**2 + along / ALONG**2))
        more = spread**2
        loose = facing * np.exp(-0.5 * (offset / (OFFSET**2 + more) + along / (ALONG**2 + more)))
        color = np.exp(-0.5 * (((hue - self.shades[index]) / SHADE) ** 2).sum(axis=1))
        return Explained(exact, loose, np.where(found, color, 0.0), index)

    def seen(self, points: FloatArray, normals: FloatArray) -> tuple[BoolArray, BoolArray]:
        """What its views say of faces at points (K, 3); see the function `seen`."""
        return seen(self._views, points, normals)


def seen(views: Sequence[CameraView], points: FloatArray, normals: FloatArray) -> tuple[BoolArray, BoolArray]:
    """(K,) True where no view can say that a face at the point, with its normal, is not there.

    A view can if the face lies in its image and turns to it, and nothing nearer stands before it. And
    (K,) True where a view sees through the point to what is farther away.
    """
    hidden, through = np.ones(len(points), dtype=bool), np.zeros(len(points), dtype=bool)
    for view in views:
        to_camera = view.T_world_camera[:3, 3] - points
        distance = np.maximum(np.linalg.norm(to_camera, axis=1), 1e-9)
        slant = np.einsum("mk,mk->m", to_camera, normals) / distance
        (column, row), z, inside = (part.T for part in project(view, points))
        depth = view.depth[row, column]
        beyond = np.where(inside & np.isfinite(depth), depth - z, -np.inf)
        hidden &= ~((beyond > -THROUGH) & (slant > GRAZING))
        through |= beyond > THROUGH
    return hidden, through


def shades(colors: Float32Array) -> FloatArray:
    """Colours (N, 3) of 0 .. 1 as (N, 4) hue and a little brightness, for light changes with a turn."""
    bright = colors.mean(axis=1, keepdims=True).astype(np.float64)
    return np.concatenate([(colors - bright) / (bright + 0.05), 0.35 * bright], axis=1)


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


def thing_of(points: FloatArray, standing: FloatArray) -> FloatArray:
    """(N, 3) the connected thing among `standing` points (M, 3) that most of `points` are part of."""
    if not len(standing):
        return points
    labels = connected(standing)
    part_of = labels[nearest(points, standing)[1][:, 0]]
    thing: FloatArray = standing[labels == np.bincount(part_of).argmax()]
    return thing


def find_goal(step: Transition, region: Region, config: PolicyConfig) -> Goal | None:
    """What stands next to the action and was not taken or pushed away by it; None if there is nothing.

    None, too, if it is the region.
    """
    still, later = (scene.cloud.select(~scene.ground.bare) for scene in (step.before, step.after))
    if not len(still):
        return None
    assert still.normals is not None
    _, gone = seen(tuple(step.after.observation.views.values()), still.points, still.normals)
    if len(later):
        gone &= ~within(still.points, later.points, SAME)
    still = still.select(~gone)
    away = np.linalg.norm(still.points - step.action.T_world_gripper[:3, 3], axis=1)
    near = away < away.min(initial=np.inf) + 2 * NEXT
    apart = near & ~within(still.points, region.cloud.points, SAME)
    known = apart.sum() < (1 - config.alone) * near.sum()
    if known or near.sum() < config.fewest or away.min() > config.goal:
        return None
    labels = connected(still.points)
    thing = still.points[np.isin(labels, labels[near])]
    return Goal(still.select(near), fading(away[near]), thing)


def obstacles(scene: Scene, region: Region) -> BoolArray:
    """(N,) which points stand in a scene and are not in the hand, if the region is not what is held."""
    stands = ~scene.ground.bare
    if len(region.p_gripper_held):
        p_held = se3.apply(scene.observation.T_world_gripper, region.p_gripper_held)
        stands &= ~within(scene.fused.points, p_held, SAME)
    return stands


def around(points: FloatArray, thing: FloatArray, motions: FloatArray) -> BoolArray:
    """(N,) which points (N, 3) have to do with a thing (M, 3) after any of the motions (H, 4, 4)."""
    corners = np.stack(np.meshgrid(*np.stack([thing.min(axis=0), thing.max(axis=0)]).T), axis=-1)
    reached = np.zeros(len(points), dtype=bool)
    for box in se3.apply(motions, corners.reshape(-1, 3)):
        reached |= inside_box(points, box.min(axis=0) - BESIDE, box.max(axis=0) + BESIDE)
    return reached
