from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from imop.errors import InvalidInput
from imop.geometry import cloud as clouds
from imop.geometry import se3
from imop.geometry.cloud import PointCloud
from imop.types import CameraView, Observation

DOWN = se3.make(se3.euler(x=np.pi), (0.2, 0.0, 1.5))


def flat_view(depth=0.75, size=32, T_world_camera=DOWN):
    K = np.array([[40.0, 0, size / 2], [0, 40.0, size / 2], [0, 0, 1]])
    return CameraView(
        np.full((size, size, 3), 200, np.uint8), np.full((size, size), depth), K, T_world_camera
    )


def observation(**views):
    return Observation(views, np.eye(4), 1.0)


def random_cloud(rng, count=200):
    return PointCloud(
        rng.uniform(-0.3, 0.3, (count, 3)),
        rng.random((count, 3), dtype=np.float32),
        np.zeros(count, np.int32),
        ids=rng.integers(0, 5, count, dtype=np.int32),
    )


def test_a_flat_table_stays_flat_and_principal_point_is_below_the_camera():
    view = flat_view()
    points = clouds.unproject(view)
    np.testing.assert_allclose(points[..., 2], 0.75, atol=1e-7)
    np.testing.assert_allclose(points[16, 16], (0.2, 0.0, 0.75), atol=1e-7)


def test_unproject_inverts_projection(rng):
    view = replace(flat_view(), depth=rng.uniform(0.5, 1.0, (32, 32)))
    pixels, depth, inside = clouds.project(view, clouds.unproject(view).reshape(-1, 3))
    v, u = np.mgrid[:32, :32]
    assert inside.all()
    np.testing.assert_array_equal(pixels, np.stack([u.ravel(), v.ravel()], axis=1))
    np.testing.assert_allclose(depth, view.depth.ravel(), atol=1e-6)


def test_points_behind_the_camera_or_beside_its_image_are_not_in_it():
    view = flat_view()
    beside = clouds.unproject(view)[16, 16] + np.array([1.0, 0.0, 0.0])
    behind = view.T_world_camera[:3, 3] - 0.1 * view.T_world_camera[:3, 2]
    pixels, _, inside = clouds.project(view, np.stack([beside, behind]))
    assert not inside.any() and not pixels.any()


@pytest.mark.parametrize("missing", [0.0, np.nan, np.inf, -1.0])
def test_unmeasured_pixels_are_dropped(missing):
    view = flat_view()
    depth = view.depth.copy()
    depth[:4] = missing
    assert len(clouds.fuse(observation(front=replace(view, depth=depth)))) == 28 * 32


def test_no_measurement_at_all_is_an_error_that_names_depth():
    with pytest.raises(InvalidInput, match="depth"):
        clouds.fuse(observation(front=flat_view(np.nan), wrist=flat_view(0.0)))


def test_a_pixel_hanging_between_two_surfaces_is_dropped_and_edges_are_kept():
    depth = np.full((32, 32), 0.75)
    depth[:, 16:] = 0.5
    assert not clouds.flying_pixels(replace(flat_view(), depth=depth)).any()
    depth[:, 15] = 0.62
    np.testing.assert_array_equal(
        np.flatnonzero(clouds.flying_pixels(replace(flat_view(), depth=depth)).all(axis=0)), [15]
    )


def test_ids_survive_only_if_every_view_has_them():
    with_ids = replace(flat_view(), instance_ids=np.full((32, 32), 3))
    assert set(clouds.fuse(observation(a=with_ids)).ids) == {3}
    assert clouds.fuse(observation(a=with_ids, b=flat_view())).ids is None


@given(st.integers(0, 1000), st.floats(0.01, 0.2))
def test_voxel_grid_keeps_one_point_per_cell_inside_it(seed, size):
    cloud = random_cloud(np.random.default_rng(seed))
    thin = clouds.voxel_downsample(cloud, size)
    cells = {tuple(c) for c in np.floor(cloud.points / size).astype(int)}
    assert len(thin) == len(cells)
    # An average may round onto the border of its cell.
    centers = (np.array(sorted(cells)) + 0.5) * size
    assert np.abs(thin.points[:, None] - centers[None]).max(axis=2).min(axis=1).max() <= size / 2 + 1e-9
    assert set(thin.ids) <= set(cloud.ids)


def test_voxel_size_must_be_positive(rng):
    with pytest.raises(InvalidInput, match="size"):
        clouds.voxel_downsample(random_cloud(rng), 0.0)


def test_crop_is_inclusive_and_exact(rng):
    cloud = random_cloud(rng)
    inside = clouds.crop(cloud, (-0.1,) * 3, (0.1,) * 3)
    assert len(inside) == np.all(np.abs(cloud.points) <= 0.1, axis=1).sum() > 0


def test_farthest_points_begin_with_the_first_and_are_each_the_farthest_from_those_before(rng):
    points = rng.normal(size=(300, 3)) + np.array([0, 0, 5])
    chosen = clouds.farthest_points(points, 120)
    expected = [0]
    while len(expected) < 120:
        to_nearest = np.linalg.norm(points[:, None] - points[expected], axis=-1).min(axis=1)
        expected.append(int(to_nearest.argmax()))
    np.testing.assert_array_equal(chosen, expected)


def test_farthest_points_are_different_ones_even_where_points_coincide():
    points = np.repeat([[0.3, 0.1, 0.8], [0.4, 0.2, 0.9]], 5, axis=0)
    assert len(set(clouds.farthest_points(points, 9).tolist())) == 9


def test_farthest_points_spread_better_than_chance(rng):
    points = rng.normal(size=(2000, 3))
    chosen = clouds.farthest_points(points, 50)
    assert len(set(chosen)) == 50

    def closest_pair(p):
        d = np.linalg.norm(p[:, None] - p[None], axis=-1)
        return d[~np.eye(len(p), dtype=bool)].min()

    assert closest_pair(points[chosen]) > 3 * closest_pair(points[:50])
    np.testing.assert_array_equal(chosen, clouds.farthest_points(points, 50))
    assert len(clouds.farthest_points(points, 5000)) == 2000


def test_normals_of_a_sphere_point_outwards_to_the_camera(rng):
    directions = rng.normal(size=(3000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    directions = directions[directions[:, 2] > 0]
    cloud = PointCloud(
        0.1 * directions, np.zeros((len(directions), 3), np.float32), np.zeros(len(directions), np.int32)
    )
    found = clouds.estimate_normals(cloud, np.array([[0, 0, 10.0]])).normals
    assert np.quantile(np.einsum("ij,ij->i", found, directions), 0.05) > 0.98


@pytest.mark.parametrize("count", [0, 1, 4])
def test_few_points_get_normals_towards_the_camera(rng, count):
    found = clouds.estimate_normals(random_cloud(rng, count), np.array([[0, 0, 10.0]]))
    assert found.normals.shape == (count, 3)
    assert np.all(found.normals[:, 2] > 0.9)


def test_normals_are_turned_to_the_camera_that_saw_the_point():
    points = np.array([[0.0, 0, 1], [0, 0, 1], [0, 0, 1]])
    cloud = clouds.PointCloud(points, np.zeros((3, 3), np.float32), np.array([0, 1, 1], np.int32))
    up = np.array([[0.0, 0, 1], [0, 0, 1], [0, 0, 0]])
    found = clouds.facing(cloud, up, np.array([[0, 0, 5.0], [3, 0, -3]])).normals
    np.testing.assert_allclose(found, [[0, 0, 1], [0, 0, -1], [0.6, 0, -0.8]])
