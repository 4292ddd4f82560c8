"""A session on a robot: frames, the workspace, failures that are said, and a stop from anywhere."""

import numpy as np
import pytest

from imop.cameras.interfaces import Frame
from imop.errors import PlanFailed
from imop.geometry import se3
from imop.robots.interfaces import DONE, MotionResult, RobotState
from imop.setup.setup import CameraSetup, RobotSetup, Setup, WorkspaceSetup
from imop.types import Action
from imop.viewing.robot import RobotWorld
from tests.policy.scenes import above

T_WORLD_BASE = se3.make(se3.euler(z=0.5), (-0.3, 0.1, 0.7))
K = np.array([[50.0, 0, 8], [0, 50, 6], [0, 0, 1]])
GOAL = Action(above(0.1, 0.1, 0.9), False, allow_collisions=True)


class FakeRobot:
    def __init__(self, T_world_gripper):
        self.T = se3.invert(T_WORLD_BASE) @ T_world_gripper
        self.opening, self.done, self.stopped, self.recovered, self.touching = 1.0, DONE, 0, 0, None

    def state(self):
        return RobotState(self.T, self.opening, np.zeros(7))

    def move_to(self, T_base_gripper, *, straight=False, allow_collisions=False):
        self.touching = allow_collisions
        if self.done.done:
            self.T = T_base_gripper
        return self.done

    def move_gripper(self, opening):
        self.opening = opening
        return DONE

    def stop(self):
        self.stopped += 1

    def recover(self):
        self.recovered += 1
        return DONE


class FakeCamera:
    def capture(self):
        return Frame(np.zeros((12, 16, 3), np.uint8), np.ones((12, 16), np.float32), K)


@pytest.fixture
def robot():
    return FakeRobot(above(0.0, 0.0, 1.0))


@pytest.fixture
def world(robot):
    setup = Setup(
        RobotSetup("panda", np.zeros(7), T_WORLD_BASE),
        WorkspaceSetup(np.array([-0.3, -0.5, 0.6]), np.array([0.7, 0.5, 1.6]), 0.75),
        {"front": CameraSetup(K, (16, 12), above(0.5, 0.0, 1.5))},
    )
    return RobotWorld(setup, robot, {"front": FakeCamera()})


def test_what_is_done_is_seen_afterwards_in_the_world_frame(world):
    assert np.allclose(world.observe().T_world_gripper, above(0.0, 0.0, 1.0))
    outcome = world.perform(GOAL)
    seen = world.observe()
    assert not outcome.over and outcome.words == ""
    assert np.allclose(seen.T_world_gripper, GOAL.T_world_gripper)
    assert (seen.gripper_opening, seen.time_step) == (0.0, 1) and world._robot.touching


def test_nothing_goes_outside_of_the_workspace(world, robot):
    before, far = robot.T, Action(above(0.1, 0.8, 0.9), True)
    for act in (world.way, world.perform):
        with pytest.raises(PlanFailed, match="outside_workspace"):
            act(far)
    assert np.array_equal(robot.T, before) and robot.opening == 1.0


def test_what_the_arm_does_not_do_is_said_and_one_can_go_on(world, robot):
    robot.done = MotionResult(False, "protective_stop", "it touched something")
    outcome = world.perform(GOAL)
    assert "protective_stop" in outcome.words and "touched" in outcome.words and not outcome.over
    assert robot.recovered == 1 and robot.opening == 1.0 and world.observe().time_step == 0
    robot.done = DONE
    assert world.perform(GOAL).words == ""


def test_a_stop_reaches_the_arm(world, robot):
    world.stop()
    assert robot.stopped == 1
