"""Collision checks of arm configurations: distances kept, contacts allowed at the start and at the goal."""

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from imop.geometry import se3
from imop.robots.panda import PANDA_HOME_Q
from imop.sim.collision import CLEARANCE, CollisionChecker, densify
from imop.sim.gripper import attach
from imop.sim.kinematics import inverse_kinematics
from imop.sim.world import TABLE_HEIGHT, World, allow_grasp, scene_spec
from imop.types import FloatArray

BOX = mujoco.mjtGeom.mjGEOM_BOX
DOWN = se3.euler(x=np.pi, z=np.pi)
X, Y, HALF = 0.35, 0.1, 0.03


@pytest.fixture(scope="module")
def world() -> World:
    """A fixed block with its top 6 cm above the table."""
    spec = scene_spec()
    block = spec.worldbody.add_body(name="block", pos=[X, Y, TABLE_HEIGHT + HALF])
    block.add_geom(type=BOX, size=[0.05, 0.1, HALF])
    return World(spec)


def finger_end() -> float:
    """How far the open fingers reach beyond the tip's origin (negative: they end before it), metres."""
    world = World(scene_spec())
    T_gripper_world = se3.invert(world.T_world_gripper)
    fingers = [
        i for i in range(world.model.ngeom) if world.model.geom(i).name.startswith("robot/left_finger")
    ]
    probe = [
        (T_gripper_world[2, :3] @ world.data.geom_xpos[i] + T_gripper_world[2, 3])
        + np.abs(T_gripper_world[2, :3] @ world.data.geom_xmat[i].reshape(3, 3)) @ world.model.geom_size[i]
        for i in fingers
        if world.model.geom_type[i] == BOX
    ]
    return float(max(probe))


FINGER_END = finger_end()


def at(z: float, reference: FloatArray = PANDA_HOME_Q) -> FloatArray:
    """The fingers' ends `z` metres over the block."""
    T = se3.make(DOWN, (X, Y, TABLE_HEIGHT + 2 * HALF + z + FINGER_END))
    return inverse_kinematics(T, reference)[0]


@pytest.mark.parametrize(("z", "valid"), [(0.02, True), (CLEARANCE / 2, False), (-0.01, False)])
def test_arm_keeps_its_clearance(world: World, z: float, valid: bool) -> None:
    assert CollisionChecker(world, allow_collisions=False).valid(at(z)) is valid


def test_allowed_collisions_are_not_checked_but_the_robot_s_own_are(world: World) -> None:
    checker = CollisionChecker(world, allow_collisions=True)
    assert checker.valid(at(-0.01))
    folded = PANDA_HOME_Q.copy()
    folded[[1, 3, 5]] = (1.7, -3.05, 0.0)
    assert not checker.valid(folded)


def test_the_gripper_may_be_as_near_as_at_the_goal(world: World) -> None:
    checker = CollisionChecker(world, allow_collisions=False)
    goal = at(0.001)
    assert not checker.valid(goal)
    checker.expect_goal(goal)
    assert checker.valid(goal) and not checker.valid(at(-0.001))


def test_a_goal_inside_something_stays_invalid(world: World) -> None:
    checker = CollisionChecker(world, allow_collisions=False)
    checker.expect_goal(at(-0.01))
    assert not checker.valid(at(-0.01))


def test_what_touches_at_the_start_may_part_but_not_sink_in(world: World) -> None:
    home, opening = world.robot_q, world.gripper_opening
    start = at(-0.004)
    world.set_robot(start, 1.0)
    checker = CollisionChecker(world, allow_collisions=False)
    world.set_robot(home, opening)
    assert checker.valid(start) and checker.valid(at(0.02, start))
    assert not checker.valid(at(-0.008, start))


def test_motion_is_checked_between_its_ends(world: World) -> None:
    checker = CollisionChecker(world, allow_collisions=False)
    left = inverse_kinematics(se3.make(DOWN, (X, Y - 0.25, 0.79)), PANDA_HOME_Q)[0]
    right = inverse_kinematics(se3.make(DOWN, (X, Y + 0.25, 0.79)), left)[0]
    assert checker.valid(left) and checker.valid(right)
    assert not checker.valid_motion(np.stack([left, right]))


def test_the_check_after_the_search_is_laxer_than_the_search(world: World) -> None:
    checker = CollisionChecker(world, allow_collisions=False)
    after = checker.after_search()
    assert not checker.valid(at(0.75 * CLEARANCE)) and after.valid(at(0.75 * CLEARANCE))
    assert not after.valid(at(0.25 * CLEARANCE))


def test_a_held_body_is_part_of_the_arm() -> None:
    spec = scene_spec()
    rod = spec.worldbody.add_body(name="rod")
    rod.add_freejoint()
    rod.add_geom(type=BOX, size=[0.01, 0.01, 0.1])
    allow_grasp(spec, "rod")
    world = World(spec)
    high, low = (
        inverse_kinematics(se3.make(DOWN, (X, Y, TABLE_HEIGHT + z)), PANDA_HOME_Q)[0] for z in (0.2, 0.05)
    )
    world.set_robot(high, 1.0)
    world.set_free_pose("rod", se3.make(p=(0.6, -0.4, 1.0)))
    assert CollisionChecker(world, allow_collisions=False).valid(low)
    world.set_free_pose("rod", world.T_world_gripper @ se3.make(p=(0, 0, 0.08)))
    assert attach(world) == ("rod",)
    held = CollisionChecker(world, allow_collisions=False)
    assert held.valid(high) and not held.valid(low), "the rod would be 13 cm in the table"


@given(st.integers(0, 10_000), st.integers(2, 6), st.floats(0.01, 1.0))
def test_densify_keeps_the_path_and_bounds_the_steps(seed: int, n: int, resolution: float) -> None:
    path = np.random.default_rng(seed).normal(size=(n, 7))
    dense = densify(path, resolution)
    steps = np.linalg.norm(np.diff(dense, axis=0), axis=1)
    assert steps.max() <= resolution + 1e-9
    assert np.isclose(steps.sum(), np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    for row in path:
        assert np.abs(dense - row).max(axis=1).min() < 1e-9
