"""Small clouds with shape and colour for the networks' tests."""

import numpy as np

from imop.geometry import se3
from imop.geometry.cloud import PointCloud
from imop.networks.graph import GraphConfig

SMALL = GraphConfig(max_points=120)


def box_surface(rng, center, size, color, count):
    """Points on the upper half of a box's surface, with normals."""
    axis = rng.integers(0, 3, count)
    side = np.where(axis == 2, 1.0, rng.choice([-1.0, 1.0], count))
    points = rng.uniform(-1, 1, (count, 3))
    points[np.arange(count), axis] = side
    normals = np.zeros((count, 3))
    normals[np.arange(count), axis] = side
    colors = np.tile(np.float32(color), (count, 1))
    return PointCloud(center + points * np.asarray(size) / 2, colors, np.zeros(count, np.int32), normals)


def tabletop(seed=0):
    """A table with a tall and a flat box."""
    from imop.geometry.cloud import concatenate

    rng = np.random.default_rng(seed)
    ground = rng.uniform(-0.3, 0.3, (900, 3))
    ground[:, 2] = 0.75
    up = np.tile([0.0, 0.0, 1.0], (900, 1))
    table = PointCloud(ground, np.full((900, 3), 0.6, np.float32), np.zeros(900, np.int32), up)
    tall = box_surface(rng, np.array([0.1, 0.05, 0.80]), (0.05, 0.04, 0.10), (0.9, 0.1, 0.1), 500)
    flat = box_surface(rng, np.array([-0.12, -0.1, 0.77]), (0.12, 0.08, 0.04), (0.1, 0.2, 0.9), 500)
    return concatenate([table, tall, flat])


def moved(cloud, T):
    """The cloud after a rigid motion; its normals turn with it."""
    return PointCloud(
        se3.apply(T, cloud.points), cloud.colors, cloud.camera, se3.rotate(T, cloud.normals), cloud.ids
    )
