"""What is left of wrong camera poses in fused clouds: each view's points are a little off."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imop.geometry import se3
from imop.geometry.cloud import PointCloud
from imop.training.data.pairs import StepPair
from imop.types import FloatArray

# Standard deviations (metres, radians) of most set-ups, and of those that are badly calibrated.
USUAL, BAD = (0.001, np.radians(0.15)), (0.003, np.radians(0.5))
BAD_SHARE = 0.2
# So often a camera has another error in the query than in the demonstration, for instance as it was knocked.
KNOCKED = 0.2


def camera_errors(pair: StepPair, rng: np.random.Generator) -> StepPair:
    """The pair with the points of each camera moved rigidly by a little, about what the camera sees.

    A camera is known by its index. Its error is mostly that of a set-up, the same in the demonstration and in
    the query. The poses and the right motions stay: the things have not moved.
    """
    cameras = 1 + max(int(cloud.camera.max()) for cloud in pair.clouds)
    centres = [_centre(pair.clouds, camera) for camera in range(cameras)]
    shown = _errors(centres, rng)
    seen = _errors(centres, rng) if rng.random() < KNOCKED else shown
    return replace(
        pair,
        support=views_moved(pair.support, shown),
        after=views_moved(pair.after, shown),
        query=views_moved(pair.query, seen),
        carry=pair.carry and replace(pair.carry, after=views_moved(pair.carry.after, shown)),
    )


def views_moved(cloud: PointCloud, T: FloatArray) -> PointCloud:
    """The cloud with the points and normals of camera c moved by T[c], for T (C, 4, 4)."""
    T_point = T[cloud.camera]
    points = np.einsum("nij,nj->ni", T_point[:, :3, :3], cloud.points) + T_point[:, :3, 3]
    if cloud.normals is None:
        return replace(cloud, points=points)
    return replace(cloud, points=points, normals=np.einsum("nij,nj->ni", T_point[:, :3, :3], cloud.normals))


def _centre(clouds: Sequence[PointCloud], camera: int) -> FloatArray:
    """(3,) the middle of what the first cloud shows that has points of the camera."""
    own = (cloud.points[cloud.camera == camera] for cloud in clouds)
    return next((points.mean(axis=0) for points in own if len(points)), np.zeros(3))


def _errors(centres: list[FloatArray], rng: np.random.Generator) -> FloatArray:
    """(C, 4, 4) a small random motion about each of the centres."""
    distance, angle = BAD if rng.random() < BAD_SHARE else USUAL
    errors = []
    for centre in centres:
        R = se3.euler(*rng.normal(0, angle, 3))
        errors.append(se3.make(R, centre - R @ centre + rng.normal(0, distance, 3)))
    return np.stack(errors)
