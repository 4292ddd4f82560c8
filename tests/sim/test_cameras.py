"""Ray cameras: depth, ids and colour agree with the scene and with each other."""

import time

import mujoco
import numpy as np
import pytest
from scipy.spatial import Delaunay

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.sim.cameras import CAMERAS, look_at, observe, render, render_view
from imop.sim.world import TABLE_HEIGHT, World, scene_spec
from imop.types import CameraView, FloatArray

HALF = 0.04
CENTRE = np.array([0.3, 0.1, TABLE_HEIGHT + HALF])


@pytest.fixture(scope="module")
def world() -> World:
    spec = scene_spec()
    box = spec.worldbody.add_body(name="box", pos=CENTRE)
    box.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[HALF] * 3, rgba=[0.9, 0.1, 0.1, 1])
    ghost = spec.worldbody.add_body(name="ghost", pos=[0.3, -0.2, 1.0])
    ghost.add_geom(size=[0.05, 0, 0], group=3)
    return World(spec)


@pytest.fixture(scope="module")
def views(world: World) -> dict[str, CameraView]:
    return render(world)


def points(view: CameraView, mask: np.ndarray) -> FloatArray:
    v, u = np.nonzero(mask & view.measured)
    d = view.depth[v, u].astype(np.float64)
    p_camera = np.stack([u * d, v * d, d], axis=1) @ np.linalg.inv(view.intrinsics).T
    return se3.apply(view.T_world_camera, p_camera)


def ids_of(world: World, name: str) -> int:
    return next(i for i, n in world.instance_names.items() if n == name)


def test_cameras_have_rlbench_intrinsics(views: dict[str, CameraView]) -> None:
    for name, view in views.items():
        f = 110.8512 if name == "wrist" else 175.8386
        assert np.allclose(view.intrinsics, [[f, 0, 64], [0, f, 64], [0, 0, 1]], atol=1e-3)
        assert view.rgb.shape == (128, 128, 3) and view.depth.dtype == np.float32


def test_forward_directions_are_rlbench_s(views: dict[str, CameraView]) -> None:
    assert np.allclose(views["front"].T_world_camera[:3, 2], (-0.9063, 0, -0.4226), atol=1e-4)
    assert np.allclose(views["left_shoulder"].T_world_camera[:3, 2], (0.4162, -0.0734, -0.9063), atol=1e-4)
    for name in ("front", "left_shoulder", "right_shoulder"):
        assert views[name].T_world_camera[2, 1] < 0, "the image's y axis points down"


def test_wrist_camera_moves_with_the_gripper(world: World) -> None:
    before = observe(world)
    home, opening = world.robot_q, world.gripper_opening
    world.set_robot(home + 0.1, opening)
    after = observe(world)
    world.set_robot(home, opening)
    relative = [se3.invert(o.T_world_gripper) @ o.views["wrist"].T_world_camera for o in (before, after)]
    assert np.allclose(*relative, atol=1e-9)
    assert np.allclose(relative[0][:3, 3], (-0.05, 0.002, -0.0921))


def test_table_points_lie_in_the_table(world: World, views: dict[str, CameraView]) -> None:
    table = ids_of(world, "table")
    for name, view in views.items():
        p = points(view, view.instance_ids == table)
        top = p[(np.abs(p[:, 2] - TABLE_HEIGHT) < 0.01)]
        assert len(top) > 1000, name
        assert np.abs(top[:, 2] - TABLE_HEIGHT).max() < 1e-4


@pytest.mark.parametrize("name", ["front", "left_shoulder", "right_shoulder"])
def test_box_appears_where_its_corners_project(world: World, name: str) -> None:
    home = world.robot_q
    world.set_robot(home + 2.5 * np.eye(7)[0], 1.0)  # out of the cameras' way
    view = render(world)[name]
    world.set_robot(home, 1.0)
    corners = CENTRE + HALF * np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    p = se3.apply(se3.invert(view.T_world_camera), corners) @ view.intrinsics.T
    uv = p[:, :2] / p[:, 2:]
    pixels = np.stack(np.meshgrid(np.arange(128), np.arange(128)), axis=-1)
    projected = Delaunay(uv).find_simplex(pixels) >= 0
    seen = view.instance_ids == ids_of(world, "box")
    assert projected.sum() > 50
    assert (projected != seen).sum() <= 1, "a ray along the very edge may fall on either side"


def test_box_points_lie_on_the_box_in_every_view(world: World, views: dict[str, CameraView]) -> None:
    seen = 0
    for view in views.values():
        p = points(view, view.instance_ids == ids_of(world, "box")) - CENTRE
        seen += len(p)
        if len(p):
            assert np.abs(np.abs(p).max(axis=1) - HALF).max() < 1e-4
    assert seen > 300


def test_views_agree_with_each_other(world: World, views: dict[str, CameraView]) -> None:
    front, left = views["front"], views["left_shoulder"]
    p = points(front, front.instance_ids == ids_of(world, "box"))
    q = se3.apply(se3.invert(left.T_world_camera), p) @ left.intrinsics.T
    u, v = np.round(q[:, :2] / q[:, 2:]).astype(int).T
    inside = (u >= 0) & (u < 128) & (v >= 0) & (v < 128)
    in_front_of_seen = q[inside, 2] < left.depth[v[inside], u[inside]] - 0.02
    assert inside.sum() > 50
    # Nothing may be in front of what the other camera sees, edges of the box aside.
    assert in_front_of_seen.mean() < 0.1


def test_nothing_hit_is_no_measurement(views: dict[str, CameraView]) -> None:
    for name, view in views.items():
        assert view.instance_ids is not None
        assert np.array_equal(view.instance_ids == 0, view.depth == 0), name
        assert view.depth.max() <= CAMERAS[name].far


def test_hidden_groups_and_clear_geoms_are_not_seen(world: World, views: dict[str, CameraView]) -> None:
    ghost = ids_of(world, "ghost")
    assert all(not np.any(view.instance_ids == ghost) for view in views.values())


def test_colours_are_the_geoms(world: World, views: dict[str, CameraView]) -> None:
    view = views["front"]
    red = view.rgb[view.instance_ids == ids_of(world, "box")].astype(float)
    assert np.all(red[:, 0] > 3 * red[:, 1]) and red[:, 0].mean() > 100


def test_resolution_changes_pixels_not_geometry(world: World) -> None:
    fine = render(world, size=256)["front"]
    coarse = render(world)["front"]
    assert np.allclose(fine.depth[::2, ::2], coarse.depth, atol=1e-5)


def test_picture_for_people(world: World) -> None:
    picture = render_view(world, look_at((1.2, -1.0, 1.6), (0.2, 0, 0.9), 45), 160, 120)
    assert picture.shape == (120, 160, 3) and picture.dtype == np.uint8
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 50
    with pytest.raises(InvalidInput, match="left_shoulder"):
        render_view(world, "overhead")


def test_observation_is_complete_and_quick(world: World) -> None:
    observe(world)
    started = time.process_time()
    observation = observe(world, time_step=3)
    assert time.process_time() - started < 0.2
    assert set(observation.views) == {"front", "left_shoulder", "right_shoulder", "wrist"}
    assert observation.time_step == 3 and observation.instance_names == world.instance_names
    assert np.allclose(observation.T_world_gripper, world.T_world_gripper)
