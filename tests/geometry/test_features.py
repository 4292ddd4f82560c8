"""FPFH: what it must not depend on, what it must tell apart, and the reference implementation."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.geometry.features import fpfh


def bumpy_surface(rng, count=600):
    """Points and normals of a smooth height field, 20 cm wide."""
    xy = rng.uniform(-0.1, 0.1, (count, 2))
    z = 0.02 * np.sin(40 * xy[:, 0]) * np.cos(25 * xy[:, 1])
    slope_x = 0.8 * np.cos(40 * xy[:, 0]) * np.cos(25 * xy[:, 1])
    slope_y = -0.5 * np.sin(40 * xy[:, 0]) * np.sin(25 * xy[:, 1])
    normals = np.stack([-slope_x, -slope_y, np.ones(count)], axis=1)
    return np.c_[xy, z], normals / np.linalg.norm(normals, axis=1, keepdims=True)


def test_rigid_motion_changes_nothing(rng):
    points, normals = bumpy_surface(rng)
    T = se3.make(Rotation.from_rotvec([0.4, -1.0, 2.0]).as_matrix(), np.array([0.3, -2.0, 1.0]))
    moved = fpfh(se3.apply(T, points), se3.rotate(T, normals), 0.03)
    # Rounding may push single pairs over a bin's edge.
    assert np.abs(fpfh(points, normals, 0.03) - moved).max() < 1.0


def test_order_of_points_does_not_matter(rng):
    points, normals = bumpy_surface(rng)
    order = rng.permutation(len(points))
    np.testing.assert_allclose(
        fpfh(points, normals, 0.03)[order], fpfh(points[order], normals[order], 0.03), atol=1e-6
    )


def test_each_histogram_sums_to_two_hundred(rng):
    points, normals = bumpy_surface(rng)
    np.testing.assert_allclose(fpfh(points, normals, 0.03).reshape(-1, 3, 11).sum(axis=2), 200.0)


def test_plane_edge_and_sphere_differ(rng):
    flat = np.c_[rng.uniform(-0.1, 0.1, (800, 2)), np.zeros(800)]
    up = np.tile([0.0, 0.0, 1.0], (800, 1))
    plane = fpfh(flat, up, 0.03)[np.argmin(np.linalg.norm(flat, axis=1))]
    ball = rng.normal(size=(800, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    sphere = fpfh(0.05 * ball, ball, 0.03)
    assert np.linalg.norm(sphere - plane, axis=1).min() > 3 * np.linalg.norm(sphere.std(axis=0))


def test_lonely_points_have_empty_histograms():
    features = fpfh(np.array([[0.0, 0, 0], [1.0, 0, 0]]), np.array([[0.0, 0, 1], [0, 0, 1]]), 0.1)
    np.testing.assert_array_equal(features, 0.0)
    assert fpfh(np.zeros((0, 3)), np.zeros((0, 3)), 0.1).shape == (0, 33)


@pytest.mark.parametrize(
    ("points", "normals", "radius", "field"),
    [
        (np.zeros((4, 2)), np.zeros((4, 2)), 0.1, "points"),
        (np.zeros((4, 3)), np.zeros((5, 3)), 0.1, "normals"),
        (np.zeros((4, 3)), np.zeros((4, 3)), 0.0, "radius"),
    ],
)
def test_wrong_input_is_named(points, normals, radius, field):
    with pytest.raises(InvalidInput) as error:
        fpfh(points, normals, radius)
    assert error.value.field == field


def test_agrees_with_open3d(rng):
    open3d = pytest.importorskip("open3d", exc_type=ImportError, reason="Open3D (extra baselines) is missing")
    points, normals = bumpy_surface(rng)
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    cloud.normals = open3d.utility.Vector3dVector(normals)
    search = open3d.geometry.KDTreeSearchParamRadius(0.03)
    theirs = np.asarray(open3d.pipelines.registration.compute_fpfh_feature(cloud, search).data).T
    np.testing.assert_allclose(fpfh(points, normals, 0.03), theirs, atol=1.0)
