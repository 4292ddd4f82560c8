"""What a scene knows of its cloud, with and without normals."""

from dataclasses import replace

import numpy as np

from imop.geometry.cloud import PointCloud
from imop.policy.interfaces import Scene
from tests.policy.scenes import RED, above, at, box, scene

HOME = above(0.2, 0.1, 1.0)


def fine_table(noise=0.0):
    """A red box on a table of points 5 mm apart, without normals; heights are off by `noise` metres."""
    rng = np.random.default_rng(0)
    x, y = (v.ravel() for v in np.meshgrid(np.arange(-0.2, 0.4, 0.005), np.arange(-0.3, 0.3, 0.005)))
    table = np.c_[x, y, 0.75 + rng.normal(0, noise, len(x))]
    thing = box((0.06, 0.06, 0.06), RED, at(0.1, 0.0))
    points = np.r_[table, thing.points]
    colors = np.r_[np.full((len(x), 3), 0.5, np.float32), thing.colors]
    observation = scene([], HOME).observation
    return Scene(observation, PointCloud(points, colors, np.zeros(len(points), np.int32))), len(x)


def test_the_ground_is_the_same_with_and_without_normals():
    query, _ = fine_table()
    known = replace(query, fused=query.cloud)
    assert query.fused.normals is None and known.cloud is known.fused
    np.testing.assert_array_equal(query.ground.bare, known.ground.bare)


def test_a_table_seen_clearly_is_found_without_normals():
    query, size = fine_table()
    assert query.ground.bare[:size].all() and query.ground.bare[size:].mean() < 0.2
    assert "cloud" not in vars(query)


def test_a_table_seen_badly_is_found_by_normals():
    query, size = fine_table(noise=0.004)
    assert query.ground.bare[:size].mean() > 0.9
    assert "cloud" in vars(query)
