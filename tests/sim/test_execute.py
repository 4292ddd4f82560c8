"""Whole actions on the simulated arm."""

import mujoco
import numpy as np
import pytest

from imop.errors import PlanFailed
from imop.geometry import se3
from imop.robots.panda import tip_pose
from imop.sim.execute import execute, move
from imop.sim.motion import WORKSPACE_LOWER, Planner
from imop.sim.world import TABLE_HEIGHT, World, allow_grasp, scene_spec
from imop.types import Action, FloatArray

BOX = mujoco.mjtGeom.mjGEOM_BOX
DOWN = se3.euler(x=np.pi, z=np.pi)


def cube_world() -> World:
    spec = scene_spec()
    cube = spec.worldbody.add_body(name="cube", pos=[0.35, 0.2, TABLE_HEIGHT + 0.02])
    cube.add_freejoint()
    cube.add_geom(type=BOX, size=[0.02, 0.02, 0.02])
    allow_grasp(spec, "cube")
    world = World(spec)
    world.step(50)
    return world


def action(position: tuple[float, ...], gripper_open: bool, allow_collisions: bool = False) -> Action:
    return Action(se3.make(DOWN, position), gripper_open, allow_collisions)


def test_tip_arrives_where_the_action_says() -> None:
    world = cube_world()
    for position in ((0.3, 0.0, 1.0), (0.35, 0.2, 0.9), (0.2, -0.25, 1.1)):
        wanted = action(position, True)
        done = execute(world, wanted)
        assert se3.translation_distance(world.T_world_gripper, wanted.T_world_gripper) < 0.001
        assert se3.rotation_distance(world.T_world_gripper, wanted.T_world_gripper) < 0.002
        assert np.abs(world.robot_dq).max() < 0.02
        assert done.joint_error < 0.001 and done.simulated_seconds > 0.3


def test_arm_stays_close_to_the_trajectory_while_it_moves() -> None:
    world = cube_world()
    trajectory = Planner(world).plan(se3.make(DOWN, (0.3, -0.2, 0.9)))
    start, errors = world.time, []

    def compare(w: World) -> None:
        elapsed = w.time - start
        q = [np.interp(elapsed, trajectory.times, column) for column in trajectory.positions.T]
        errors.append(np.abs(w.robot_q - q).max())

    move(world, trajectory, on_frame=compare)
    assert len(errors) > 10 and max(errors) < 0.005


def test_cube_is_picked_carried_and_placed() -> None:
    world = cube_world()
    execute(world, action((0.35, 0.2, 0.87), True))
    execute(world, action((0.35, 0.2, 0.775), False))
    assert world.held == ("cube",)
    grasped = se3.invert(world.T_world_gripper) @ world.pose("cube")
    execute(world, action((0.35, 0.2, 0.95), False), linear=True)
    execute(world, action((0.2, -0.2, 0.8), False))
    carried = se3.invert(world.T_world_gripper) @ world.pose("cube")
    assert se3.translation_distance(carried, grasped) < 0.002
    execute(world, action((0.2, -0.2, 0.776), True))
    execute(world, action((0.2, -0.2, 0.95), True))
    assert world.held == ()
    assert np.allclose(world.pose("cube")[:3, 3], (0.2, -0.2, TABLE_HEIGHT + 0.02), atol=0.004)


def drawer_world(radius: float) -> tuple[World, FloatArray]:
    """A drawer with a bar to pull; the pose in the drawer's frame that grasps it from above at an angle."""
    spec = scene_spec()
    drawer = spec.worldbody.add_body(name="drawer", pos=[0.25, -0.2, 1.0])
    drawer.add_joint(
        name="slide",
        type=mujoco.mjtJoint.mjJNT_SLIDE,
        axis=[0, 1, 0],
        range=[0, 0.25],
        damping=2.0,
        frictionloss=1.0,
    )
    drawer.add_geom(type=BOX, size=[0.15, 0.15, 0.05], mass=0.5)
    ends = [
        ((-0.05, 0.19, 0), (0.05, 0.19, 0)),
        ((-0.05, 0.15, 0), (-0.05, 0.19, 0)),
        ((0.05, 0.15, 0), (0.05, 0.19, 0)),
    ]
    for a, b in ends:
        drawer.add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[*a, *b], size=[radius, 0, 0], mass=0.02)
    z = np.array([0, -np.cos(0.5), -np.sin(0.5)])
    x = np.array([-1.0, 0, 0])
    R = np.stack([x, np.cross(z, x), z], axis=1)
    return World(spec), se3.make(R, np.array([0, 0.19, 0]) + 0.008 * z)


@pytest.mark.parametrize("radius", [0.004, 0.008])
def test_drawer_is_pulled_open_by_friction(radius: float) -> None:
    world, T_drawer_gripper = drawer_world(radius)
    T = world.pose("drawer") @ T_drawer_gripper
    execute(world, Action(T @ se3.make(p=(0, 0, -0.1)), True))
    execute(world, Action(T, False))
    assert world.held == ()
    execute(world, Action(se3.make(p=(0, 0.2, 0)) @ T, False, allow_collisions=True))
    assert world.joint("slide") == pytest.approx(0.2, abs=0.01)
    execute(world, Action(world.T_world_gripper, True))
    assert world.joint("slide") == pytest.approx(0.2, abs=0.01)


def test_failed_plan_leaves_the_world_as_it_was() -> None:
    world = cube_world()
    before = world.save_state()
    with pytest.raises(PlanFailed, match="unreachable"):
        execute(world, action((0.77, 0.65, 0.8), False))
    assert np.array_equal(world.save_state().physics, before.physics)


def test_a_target_below_the_workspace_is_raised_only_if_the_motion_is_insisted_on() -> None:
    below = action((0.3, 0.0, WORKSPACE_LOWER[2] - 0.01), False, allow_collisions=True)
    with pytest.raises(PlanFailed):
        execute(cube_world(), below)
    world = cube_world()
    execute(world, below, insist=True)
    assert abs(world.T_world_gripper[2, 3] - WORKSPACE_LOWER[2]) < 0.002


def test_equal_worlds_and_seeds_end_equal() -> None:
    ends = []
    for _ in range(2):
        world = cube_world()
        execute(world, action((0.35, 0.2, 0.78), False), seed=3)
        ends.append(world.data.qpos.copy())
    assert np.array_equal(*ends)


def test_pushing_against_something_fixed_ends_and_stays_stable() -> None:
    world = cube_world()
    execute(world, action((0.45, -0.1, 0.9), False))
    below = action((0.45, -0.1, 0.7525), False, allow_collisions=True)
    done = execute(world, below)
    assert done.simulated_seconds < 5.0
    assert np.all(np.isfinite(world.data.qpos)) and np.abs(world.robot_dq).max() < 0.5
    assert se3.translation_distance(tip_pose(world.robot_q), below.T_world_gripper) < 0.02


def test_frames_are_reported_at_a_steady_rate() -> None:
    world = cube_world()
    times: list[float] = []
    execute(world, action((0.35, 0.2, 0.9), False), on_frame=lambda w: times.append(w.time))
    assert len(times) > 10
    assert np.all(np.diff(times) > 0.04) and np.all(np.diff(times) < 0.1)
