from dataclasses import replace

import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.geometry.cloud import PointCloud, estimate_normals, fuse
from imop.geometry.perception import Perception, find_ground, open_ground, open_plane, supporting_plane
from tests.geometry.test_cloud import flat_view, observation


def table_with_box():
    """Seen from above at 1.5 m: a table at 0.75 m with a box 0.1 m high on it."""
    view = flat_view(size=96)
    depth = view.depth.copy()
    depth[40:56, 40:56] = 0.65
    return observation(front=replace(view, depth=depth))


def test_finds_the_table_and_not_the_box():
    cloud = Perception()(table_with_box())
    plane = supporting_plane(cloud)
    np.testing.assert_allclose(plane.normal, (0, 0, 1), atol=1e-3)
    assert plane.offset == pytest.approx(0.75, abs=1e-3)
    assert np.ptp(plane.height(cloud.points)) == pytest.approx(0.1, abs=2e-3)


def test_a_tilted_camera_does_not_tilt_the_plane(rng):
    points = np.concatenate([rng.uniform(-0.4, 0.4, (4000, 2)), np.full((4000, 1), 0.75)], axis=1)
    points[:, 2] += 0.05 * points[:, 0]
    cloud = PointCloud(points, np.zeros((4000, 3), np.float32), np.zeros(4000, np.int32))
    plane = supporting_plane(estimate_normals(cloud, np.array([[0, 0, 2.0]])))
    assert np.abs(plane.height(points)).max() < 1e-3 + 0.05 * 0.4


def test_no_plane_in_a_wall(rng):
    points = rng.uniform(-0.4, 0.4, (1000, 3))
    points[:, 0] = 0.3
    cloud = PointCloud(points, np.zeros((1000, 3), np.float32), np.zeros(1000, np.int32))
    assert supporting_plane(estimate_normals(cloud, np.array([[-2.0, 0, 0]]))) is None
    with pytest.raises(InvalidInput, match="normals"):
        supporting_plane(cloud)


def test_everything_outside_the_workspace_is_an_error():
    far = observation(front=flat_view(T_world_camera=se3.make(se3.euler(x=np.pi), (9.0, 0, 1.5))))
    with pytest.raises(InvalidInput, match="workspace"):
        Perception()(far)


def test_the_robot_mask_gets_world_points_joints_and_opening():
    seen = {}

    def mask(points, joint_positions, opening):
        seen.update(points=points, joints=joint_positions, opening=opening)
        return points[:, 2] > 0.8

    plain = table_with_box()
    scene = replace(plain, joint_positions=np.arange(7.0))
    assert Perception(robot_mask=mask)(scene).points[:, 2].max() < 0.8
    np.testing.assert_array_equal(seen["joints"], np.arange(7.0))
    assert seen["opening"] == 1.0 and len(seen["points"]) <= len(fuse(scene))
    with pytest.raises(InvalidInput, match="joint_positions"):
        Perception(robot_mask=mask)(plain)


def test_the_cap_holds_and_the_result_repeats():
    perception = Perception(max_points=300)
    first, second = perception(table_with_box()), perception(table_with_box())
    assert len(first) == 300
    np.testing.assert_array_equal(first.points, second.points)


def test_privileged_fields_change_nothing():
    plain = table_with_box()
    view = plain.views["front"]
    told = replace(
        plain,
        views={"front": replace(view, instance_ids=np.ones_like(view.depth, dtype=np.int32))},
        joint_velocities=np.ones(7),
        instance_names={1: "box"},
    )
    np.testing.assert_array_equal(Perception()(plain).points, Perception()(told.stripped()).points)


def tabletop(paint):
    """A level table of 1,681 points, coloured by `paint`, with a column of 41 points on it."""
    x, y = (v.ravel() for v in np.meshgrid(np.linspace(-0.2, 0.2, 41), np.linspace(-0.2, 0.2, 41)))
    column = np.c_[np.full(41, 0.1), np.full(41, 0.1), np.linspace(0.01, 0.2, 41)]
    points = np.r_[np.c_[x, y, np.zeros(len(x))], column]
    normals = np.tile([0.0, 0, 1], (len(points), 1))
    normals[len(x) :] = (1, 0, 0)
    colors = np.float32(np.where(paint(points)[:, None], (0.9, 0.1, 0.1), (0.5, 0.5, 0.5)))
    return PointCloud(points, colors, np.zeros(len(points), np.int32), normals)


def test_a_mark_on_the_table_is_not_bare_ground():
    cloud = tabletop(lambda p: np.linalg.norm(p[:, :2] + 0.1, axis=1) < 0.05)
    red = cloud.colors[:, 0] > 0.8
    bare = find_ground(cloud).bare
    assert red.any() and np.array_equal(bare, ~red & (cloud.points[:, 2] < 0.008))


def test_a_patterned_table_is_bare_ground():
    cloud = tabletop(lambda p: np.floor(p[:, 0] / 0.05) % 2 == 0)
    assert np.array_equal(find_ground(cloud).bare, cloud.points[:, 2] < 0.008)


def table_points(tilt=0.0, noise=0.0):
    """A table of points 5 mm apart with a box of 6 cm on it, and which points are of the box."""
    rng = np.random.default_rng(0)
    x, y = (v.ravel() for v in np.meshgrid(np.arange(-0.3, 0.3, 0.005), np.arange(-0.3, 0.3, 0.005)))
    table = np.c_[x, y, 0.75 + tilt * x + rng.normal(0, noise, len(x))]
    box = np.c_[rng.uniform(-0.03, 0.03, (400, 2)), 0.75 + rng.uniform(0.005, 0.06, 400)]
    return np.r_[table, box], np.arange(len(table) + 400) >= len(table)


@pytest.mark.parametrize("tilt", [0.0, 0.01])
def test_open_ground_is_the_table_away_from_things(tilt):
    points, box = table_points(tilt, noise=0.0005)
    bare = open_ground(points)
    from_box = np.abs(points[:, :2]).max(axis=1) - 0.03
    assert not bare[box].any() and not bare[from_box < 0.01].any()
    assert bare[from_box > 0.03].all()


def test_a_rough_surface_has_no_open_ground():
    points, _ = table_points(noise=0.01)
    assert open_ground(points).mean() < 0.1
    assert not open_ground(points[:20]).any()


def test_normals_of_open_ground_are_those_of_the_search():
    points, box = table_points(tilt=0.01)
    camera = np.zeros(len(points), np.int32)
    cloud = PointCloud(points, np.zeros((len(points), 3), np.float32), camera)
    above = np.array([[0.0, 0.0, 2.0]])
    searched = estimate_normals(cloud, above).normals
    known = estimate_normals(cloud, above, flat=open_ground(points)).normals
    away = np.abs(points[:, :2]).max(axis=1) > 0.05
    np.testing.assert_allclose(known[away], searched[away], atol=1e-3)
    np.testing.assert_allclose(known[box], searched[box], atol=1e-9)


@pytest.mark.parametrize("tilt", [0.0, 0.05, -0.1])
def test_the_open_plane_is_the_table(tilt):
    points, box = table_points(tilt, noise=0.0005)
    plane = open_plane(points[~box])
    assert np.abs(plane.height(points[~box])).max() < 0.003
    assert plane.normal[2] > 0 and np.all(plane.height(points[box]) > 0.003)


def test_what_is_steep_or_next_to_nothing_is_no_open_plane():
    points, _ = table_points()
    assert open_plane(points[:, [2, 1, 0]]) is None
    assert open_plane(points[:20]) is None


def test_ground_needs_normals_or_a_plane():
    cloud = Perception().points(table_with_box())
    assert cloud.normals is None
    with pytest.raises(InvalidInput, match="normals"):
        find_ground(cloud)
    with_normals = Perception()(table_with_box())
    np.testing.assert_array_equal(cloud.points, with_normals.points)
    plane = open_plane(cloud.points[open_ground(cloud.points)])
    np.testing.assert_array_equal(find_ground(cloud, plane).bare, find_ground(with_normals).bare)


def test_a_large_image_is_thinned_by_a_coarser_grid():
    focal, middle = 750.0, 200.0
    K = np.array([[focal, 0, middle], [0, focal, middle], [0, 0, 1]])
    seen = observation(front=replace(flat_view(size=400), intrinsics=K))
    most = len(Perception(voxel=0.002).points(seen)) // 4
    assert most > 4000
    few = Perception(voxel=0.002, max_points=most).points(seen)
    assert most / 2 < len(few) <= most
