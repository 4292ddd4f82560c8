from itertools import pairwise

import numpy as np
import pytest

from imop.cameras.interfaces import Camera
from imop.errors import InvalidInput
from imop.geometry import se3
from imop.robots.interfaces import Robot
from imop.robots.limits import Limits
from imop.robots.panda import T_WORLD_BASE
from imop.sim.cameras import observe
from imop.sim.driver import SimulatedCamera, SimulatedRobot
from imop.sim.world import World, scene_spec

DOWN = np.diag([-1.0, 1.0, -1.0])


def base(x, y, z):
    return se3.invert(T_WORLD_BASE) @ se3.make(DOWN, (x, y, z))


@pytest.fixture
def robot() -> SimulatedRobot:
    return SimulatedRobot(World(scene_spec()))


def test_it_goes_where_it_is_told_in_the_frame_of_its_base(robot):
    driver: Robot = robot
    before = driver.state()
    assert driver.move_to(base(0.3, 0.1, 0.9)).done
    after = driver.state()
    assert se3.near(after.T_base_gripper, base(0.3, 0.1, 0.9), 0.001, 0.005)
    assert after.stamp > before.stamp and len(after.joint_positions) == 7
    assert driver.move_gripper(0.3).done
    assert driver.state().gripper_opening == pytest.approx(0.3, abs=0.03)


def test_what_cannot_be_done_is_a_reason_and_moves_nothing(robot):
    before = robot.state()
    for T, reason in ((base(0.3, 0.1, 0.7), "outside_workspace"), (base(0.7, 0.6, 1.7), "unreachable")):
        result = robot.move_to(T)
        assert (result.done, result.reason) == (False, reason)
    np.testing.assert_array_equal(robot.state().joint_positions, before.joint_positions)
    with pytest.raises(InvalidInput, match="opening"):
        robot.move_gripper(80)
    assert robot.recover().done


def test_a_stop_ends_the_motion_and_the_next_one_is_done(robot, monkeypatch):
    watch, frames = robot._watch, []

    def after_some_frames(world):
        frames.append(world.time)
        if len(frames) == 8:
            robot.stop()
        watch(world)

    monkeypatch.setattr(robot, "_watch", after_some_frames)
    goal = base(0.3, -0.3, 0.9)
    assert robot.move_to(goal).reason == "stopped"
    halted = robot.state()
    assert not se3.near(halted.T_base_gripper, goal, 0.05, 0.5)
    robot.world.step(300)
    assert se3.near(robot.state().T_base_gripper, halted.T_base_gripper, 0.003, 0.02)
    assert robot.move_to(goal).done


def test_it_is_no_faster_than_its_limits_and_says_where_it_is_on_its_way():
    states, world = [], World(scene_spec())
    limits = Limits(speed=0.2, turn=0.5, joint_speed=0.4)
    robot = SimulatedRobot(world, limits, lambda world: states.append(robot.state()))
    goal = base(0.3, -0.2, 0.9) @ se3.make(se3.euler(z=0.8))
    assert robot.move_to(goal).done
    pairs = list(pairwise(states))
    assert len(pairs) > 20 and all(a.stamp < b.stamp for a, b in pairs)
    fastest = [
        max(distance(a, b) / (b.stamp - a.stamp) for a, b in pairs)
        for distance in (
            lambda a, b: se3.translation_distance(a.T_base_gripper, b.T_base_gripper),
            lambda a, b: se3.rotation_distance(a.T_base_gripper, b.T_base_gripper),
            lambda a, b: np.abs(a.joint_positions - b.joint_positions).max(),
        )
    ]
    shares = np.array(fastest) / (limits.speed, limits.turn, limits.joint_speed)
    assert 0.9 < shares.max() < 1.1


def test_what_may_touch_things_is_done_where_they_stop_it(robot):
    assert robot.move_to(base(0.3, 0.1, 0.9)).done
    into_the_table = base(0.3, 0.1, 0.753) @ se3.make(se3.euler(x=0.3))
    assert robot.move_to(into_the_table).reason == "goal_in_collision"
    assert robot.move_to(into_the_table, allow_collisions=True).done


def test_a_camera_sees_what_observations_show(robot):
    camera: Camera = SimulatedCamera(robot.world, "front")
    expected = observe(robot.world).views["front"]
    frame = camera.capture()
    np.testing.assert_array_equal(frame.rgb, expected.rgb)
    np.testing.assert_array_equal(frame.depth, expected.depth)
    np.testing.assert_allclose(frame.intrinsics, expected.intrinsics)
    assert SimulatedCamera(robot.world, "wrist", (32, 24)).capture().rgb.shape == (24, 32, 3)
