"""Grasping: what is attached, when it is let go, and that the weld holds."""

import mujoco
import numpy as np
import pytest

from imop.geometry import se3
from imop.robots.panda import PANDA_HOME_Q
from imop.sim.gripper import attach, between_fingers, release, set_gripper
from imop.sim.kinematics import inverse_kinematics
from imop.sim.world import TABLE_HEIGHT, World, allow_grasp, scene_spec

DOWN = se3.euler(x=np.pi, z=np.pi)
TIP = se3.make(DOWN, (0.35, 0.1, TABLE_HEIGHT + 0.2))


def world_with_cube(graspable: bool = True, half: float = 0.02) -> World:
    """A cube between the open fingers, 5 mm behind the finger ends, in the air."""
    spec = scene_spec()
    cube = spec.worldbody.add_body(name="cube", gravcomp=1)
    cube.add_freejoint()
    cube.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[half] * 3)
    if graspable:
        allow_grasp(spec, "cube")
    world = World(spec)
    world.set_robot(inverse_kinematics(TIP, PANDA_HOME_Q)[0], 1.0)
    world.set_free_pose("cube", TIP @ se3.make(p=(0, 0, half - 0.01)))
    return world


def T_gripper_cube(world: World) -> np.ndarray:
    return se3.invert(world.T_world_gripper) @ world.pose("cube")


def test_closing_attaches_and_opening_releases() -> None:
    world = world_with_cube()
    set_gripper(world, False)
    assert world.held == ("cube",)
    assert 0.3 < world.gripper_opening < 0.6, "blocked by a 4 cm cube"
    set_gripper(world, True)
    assert world.held == () and world.gripper_opening > 0.98


def test_attached_body_keeps_its_place_in_the_hand() -> None:
    world = world_with_cube()
    before = T_gripper_cube(world)
    set_gripper(world, False)
    world.step(200)
    assert se3.translation_distance(T_gripper_cube(world), before) < 0.002
    assert se3.rotation_distance(T_gripper_cube(world), before) < 0.02


def test_attaching_moves_nothing_even_far_from_the_compiled_pose() -> None:
    world = world_with_cube()
    world.set_free_pose("cube", TIP @ se3.make(se3.euler(0.3, 0.2, 0.8), (0.002, 0.005, 0.004)))
    before = T_gripper_cube(world)
    assert attach(world) == ("cube",)
    world.step(250)
    assert se3.translation_distance(T_gripper_cube(world), before) < 0.002
    assert se3.rotation_distance(T_gripper_cube(world), before) < 0.02


def test_released_body_falls() -> None:
    world = world_with_cube()
    world.model.body_gravcomp[world.model.body("cube").id] = 0
    set_gripper(world, False)
    z = world.pose("cube")[2, 3]
    world.step(250)
    assert world.pose("cube")[2, 3] == pytest.approx(z, abs=0.002)
    set_gripper(world, True)
    assert world.pose("cube")[2, 3] < z - 0.1


def test_only_declared_bodies_are_attached() -> None:
    world = world_with_cube(graspable=False)
    set_gripper(world, False)
    assert world.held == () and world.gripper_opening > 0.3, "still blocked by contact"


@pytest.mark.parametrize("offset", [(0, 0.07, 0), (0, 0, 0.04), (0.04, 0, 0), (0, -0.07, -0.02)], ids=str)
def test_what_is_not_between_the_fingers_is_not_attached(offset: tuple[float, ...]) -> None:
    world = world_with_cube()
    world.set_free_pose("cube", TIP @ se3.make(p=offset))
    assert between_fingers(world) == ()


def test_a_body_that_encloses_the_volume_is_between_the_fingers() -> None:
    world = world_with_cube(half=0.039)
    assert between_fingers(world) == ("cube",)


def test_same_request_twice_changes_nothing() -> None:
    world = world_with_cube()
    clock = world.time
    set_gripper(world, True)
    assert world.time == clock
    set_gripper(world, False)
    clock = world.time
    set_gripper(world, False)
    assert world.time == clock and world.held == ("cube",)


def test_fingers_stop_where_they_are_told() -> None:
    world = world_with_cube()
    world.set_free_pose("cube", TIP @ se3.make(p=(0, 0, 0.3)))
    for opening in (0.6, 0.3, 0.7):
        set_gripper(world, False, opening=opening)
        assert world.gripper_opening == pytest.approx(opening, abs=0.02)
    clock = world.time
    set_gripper(world, False, opening=0.7)
    assert world.time == clock
    set_gripper(world, False)
    assert world.gripper_opening < 0.02, "half closed is not closed"


def test_closing_by_a_part_attaches_and_opening_by_a_part_releases() -> None:
    world = world_with_cube()
    set_gripper(world, False, opening=0.6)
    assert world.held == ("cube",) and world.gripper_opening > 0.57, "4 cm are not touched at 4.8 cm"
    set_gripper(world, False, opening=0.8)
    assert world.held == ()


def test_release_lets_go_without_moving_time() -> None:
    world = world_with_cube()
    attach(world)
    clock = world.time
    release(world)
    assert world.held == () and world.time == clock


def test_frames_are_reported_every_twentieth_of_a_second() -> None:
    world = world_with_cube()
    times: list[float] = []
    set_gripper(world, False, on_frame=lambda w: times.append(w.time))
    assert len(times) >= 2 and np.allclose(np.diff(times), 0.05)
