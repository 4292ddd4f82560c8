"""A guarded arm: not out of the workspace, not too fast, stopped by an interrupt, and never an exception."""

import threading

import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.robots.guarded import GuardedRobot
from imop.robots.interfaces import DONE, MotionResult, Robot, RobotState
from imop.robots.limits import Limits

T_WORLD_BASE = se3.make(se3.euler(z=1.0), (0.2, -0.1, 0.7))
LOWER, UPPER = np.array([-0.5, -0.5, 0.7]), np.array([0.5, 0.5, 1.5])


def seen(x, y, z):
    return se3.invert(T_WORLD_BASE) @ se3.make(np.eye(3), (x, y, z))


class SteppingRobot:
    """Goes through given poses, one whenever it is looked at, a tenth of a second of its clock later."""

    def __init__(self, *way):
        self.way, self.at, self.T = list(way), 0, seen(0.0, 0.0, 1.0)
        self.stopped, self.looked, self.moves = threading.Event(), threading.Semaphore(0), 0
        self.problem = None

    def state(self):
        self.looked.release()
        return RobotState(self.T, 1.0, np.zeros(6), 0.1 * self.at)

    def move_to(self, T_base_gripper, *, straight=False, allow_collisions=False):
        self.moves += 1
        if self.problem is not None:
            raise self.problem
        for T in self.way:
            self.looked.acquire(timeout=1)
            if self.stopped.is_set():
                return MotionResult(False, "stopped")
            self.T, self.at = T, self.at + 1
        self.looked.acquire(timeout=1)
        self.looked.acquire(timeout=1)
        return DONE

    def move_gripper(self, opening):
        return DONE

    def stop(self):
        self.stopped.set()

    def recover(self):
        return DONE


def guarded(robot, limits=Limits(speed=0.5)) -> Robot:  # noqa: B008 (frozen)
    return GuardedRobot(robot, T_WORLD_BASE, LOWER, UPPER, limits)


def line(*ends, steps=12):
    return [seen(*p) for p in np.linspace(*ends, steps)]


def test_what_is_inside_and_slow_is_done():
    robot = SteppingRobot(*line((0, 0, 1), (0.4, 0, 1)))
    assert guarded(robot).move_to(seen(0.4, 0, 1)).done
    assert not robot.stopped.is_set()
    assert guarded(robot).move_gripper(0.2).done and guarded(robot).recover().done


def test_nothing_is_sent_out_of_the_workspace_of_the_world():
    robot = SteppingRobot()
    for p in ((0.6, 0, 1), (0, 0, 0.6), (0, -0.6, 1)):
        result = guarded(robot).move_to(seen(*p))
        assert result.reason == "outside_workspace" and robot.moves == 0


def test_an_arm_that_leaves_the_workspace_on_its_way_is_stopped():
    robot = SteppingRobot(*line((0, 0, 1), (0.8, 0, 1), steps=24), *line((0.8, 0, 1), (0.4, 0, 1)))
    result = guarded(robot).move_to(seen(0.4, 0, 1))
    assert result.reason == "outside_workspace" and robot.stopped.is_set()
    assert se3.translation_distance(robot.T, seen(0, 0, 1)) < 0.7


def test_an_arm_that_stands_outside_may_come_back():
    robot = SteppingRobot(*line((0.8, 0, 1), (0.4, 0, 1)))
    robot.T = seen(0.8, 0, 1)
    assert guarded(robot).move_to(seen(0.4, 0, 1)).done


@pytest.mark.parametrize(
    ("limits", "what"), [(Limits(speed=0.2), "gripper"), (Limits(turn=0.1, speed=0.5), "rad/s")]
)
def test_an_arm_that_is_faster_than_allowed_is_stopped(limits, what):
    way = [T @ se3.make(se3.euler(z=0.1 * k)) for k, T in enumerate(line((0, 0, 1), (0.4, 0, 1)))]
    robot = SteppingRobot(*way)
    result = guarded(robot, limits).move_to(seen(0.4, 0, 1))
    assert result.reason == "speed_limit" and what in result.detail and robot.stopped.is_set()


def test_an_interrupt_stops_the_arm_before_it_goes_on():
    robot = SteppingRobot(*line((0, 0, 1), (0.4, 0, 1)))
    look, looks = robot.state, []

    def interrupted():
        looks.append(robot.at)
        if len(looks) == 4:
            raise KeyboardInterrupt
        return look()

    robot.state = interrupted
    with pytest.raises(KeyboardInterrupt):
        guarded(robot).move_to(seen(0.4, 0, 1))
    assert robot.stopped.is_set() and 0 < robot.at < 12


def test_what_a_driver_raises_is_a_result_but_bad_input_is_bad_input():
    robot = SteppingRobot()
    robot.problem = OSError("no route to host")
    result = guarded(robot).move_to(seen(0, 0, 1))
    assert result.reason == "disconnected" and "no route" in result.detail
    robot.problem = InvalidInput("T_base_gripper", "odd", "even")
    with pytest.raises(InvalidInput, match="even"):
        guarded(robot).move_to(seen(0, 0, 1))
    with pytest.raises(InvalidInput, match="opening"):
        guarded(robot).move_gripper(40)


def test_an_arm_that_does_not_answer_can_be_recovered():
    robot = SteppingRobot()

    def silent():
        raise ConnectionError("nobody is there")

    robot.state = silent
    assert guarded(robot).move_to(seen(0, 0, 1)).reason == "disconnected" and robot.moves == 0
    assert guarded(robot).recover().done
