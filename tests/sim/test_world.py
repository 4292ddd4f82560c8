"""The simulated world: layout, instances, poses, and states that can be saved."""

import mujoco
import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.robots.panda import PANDA_HOME_Q, tip_pose
from imop.sim.world import TABLE_HEIGHT, World, allow_grasp, scene_spec

BOX = mujoco.mjtGeom.mjGEOM_BOX


def furnished_world() -> World:
    spec = scene_spec()
    cube = spec.worldbody.add_body(name="cube", pos=[0.35, 0.2, TABLE_HEIGHT + 0.1])
    cube.add_freejoint()
    cube.add_geom(type=BOX, size=[0.02, 0.02, 0.02])
    knob = cube.add_body(name="knob", pos=[0, 0, 0.03])
    knob.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.01, 0, 0])
    cabinet = spec.worldbody.add_body(name="cabinet", pos=[0.2, -0.3, TABLE_HEIGHT + 0.1])
    cabinet.add_geom(type=BOX, size=[0.05, 0.05, 0.1])
    shelf = cabinet.add_body(name="shelf")
    shelf.add_geom(type=BOX, size=[0.05, 0.06, 0.01])
    drawer = cabinet.add_body(name="drawer", pos=[0, 0.06, 0])
    drawer.add_joint(name="slide", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 1, 0], range=[0, 0.2])
    drawer.add_geom(type=BOX, size=[0.04, 0.01, 0.02])
    allow_grasp(spec, "cube")
    return World(spec)


def test_home_is_where_kinematics_says() -> None:
    world = World(scene_spec())
    assert np.abs(world.T_world_gripper - tip_pose(PANDA_HOME_Q)).max() < 1e-6
    assert np.allclose(world.robot_q, PANDA_HOME_Q)
    assert world.gripper_opening == pytest.approx(1.0)


def test_arm_stays_at_home_under_gravity() -> None:
    world = World(scene_spec())
    world.step(500)
    assert np.abs(world.robot_q - PANDA_HOME_Q).max() < 1e-3


def test_object_comes_to_rest_on_the_table() -> None:
    world = furnished_world()
    world.step(500)
    assert world.pose("cube")[2, 3] == pytest.approx(TABLE_HEIGHT + 0.02, abs=1e-4)


def test_an_instance_is_what_moves_rigidly_together() -> None:
    world = furnished_world()
    instance = {n: int(world.instances[world.model.body(n).id]) for n in ("cube", "knob", "cabinet", "shelf")}
    drawer = int(world.instances[world.model.body("drawer").id])
    assert instance["cube"] == instance["knob"] and instance["cabinet"] == instance["shelf"]
    assert len({instance["cube"], instance["cabinet"], drawer}) == 3
    robot = {int(world.instances[i]) for i in world.robot_bodies}
    assert len(robot) == 1 and world.instance_names[robot.pop()] == "robot"
    assert world.instance_names[drawer] == "drawer"
    assert {"table", "wall", "floor", "cube", "cabinet"} <= set(world.instance_names.values())


def test_poses_of_free_and_fixed_bodies_are_set() -> None:
    world = furnished_world()
    T = se3.make(se3.euler(z=0.7), (0.1, 0.3, 0.9))
    world.set_free_pose("cube", T)
    assert np.allclose(world.pose("cube"), T)
    opening = world.pose("drawer")[:3, 3] - world.pose("cabinet")[:3, 3]
    world.set_free_pose("cabinet", T)
    assert np.allclose(world.pose("cabinet"), T)
    moved = world.pose("drawer")[:3, 3] - T[:3, 3]
    assert np.allclose(moved, T[:3, :3] @ opening)


def test_a_jointed_body_cannot_be_posed() -> None:
    with pytest.raises(InvalidInput, match="drawer"):
        furnished_world().set_free_pose("drawer", np.eye(4))


def test_joint_is_set_and_moves_its_body() -> None:
    world = furnished_world()
    y = world.pose("drawer")[1, 3]
    world.set_joint("slide", 0.1)
    assert world.joint("slide") == pytest.approx(0.1)
    assert world.pose("drawer")[1, 3] == pytest.approx(y + 0.1)


def test_restored_state_continues_bit_for_bit() -> None:
    world = furnished_world()
    world.step(40)
    world.data.ctrl[world.arm_ctrl] += 0.1
    state = world.save_state()
    world.step(100)
    first = world.data.qpos.copy()
    world.set_free_pose("cabinet", se3.make(p=(0.5, 0.3, 0.9)))
    world.model.eq_data[:] = 7.0
    world.step(30)
    world.restore_state(state)
    world.step(100)
    assert np.array_equal(world.data.qpos, first)


def test_state_carries_over_to_a_world_of_the_same_spec() -> None:
    world, other = furnished_world(), furnished_world()
    world.set_free_pose("cabinet", se3.make(p=(0.5, 0.3, 0.9)))
    world.step(50)
    other.restore_state(world.save_state())
    world.step(50)
    other.step(50)
    assert np.array_equal(world.data.qpos, other.data.qpos)


def test_graspable_bodies_are_declared_and_start_free() -> None:
    world = furnished_world()
    assert world.graspable == ("cube",) and world.held == ()
