"""The drivers of real arms, on fakes of their makers' packages."""

import importlib
import sys
import threading

import numpy as np
import pytest

from imop.errors import MissingExtra
from imop.geometry import se3
from imop.robots.interfaces import DONE, MotionResult, Robot
from imop.robots.limits import Limits
from tests.robots.fakes import Controller, franky_module, ur_modules

T_FLANGE_GRIPPER = se3.make(se3.euler(z=-0.7), (0.0, 0.0, 0.1))
LIMITS = Limits(speed=0.2, turn=0.5, joint_speed=0.7)
GOAL = se3.make(se3.euler(x=3.0, z=0.4), (0.4, 0.1, 0.3))


class Fingers:
    """A gripper without a maker."""

    def __init__(self):
        self.at, self.closed = 1.0, False

    def opening(self):
        return self.at

    def move(self, opening, stopped):
        if stopped():
            return MotionResult(False, "stopped")
        self.at = opening
        return DONE

    def close(self):
        self.closed = True


@pytest.fixture
def franka(monkeypatch):
    monkeypatch.setitem(sys.modules, "franky", franky_module())
    monkeypatch.delitem(sys.modules, "imop.robots.franka", raising=False)
    module = importlib.import_module("imop.robots.franka")
    monkeypatch.delitem(sys.modules, "imop.robots.franka")
    return module


@pytest.fixture
def controller():
    return Controller()


@pytest.fixture
def universal(monkeypatch, controller):
    for name, module in ur_modules(controller).items():
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.delitem(sys.modules, "imop.robots.universal_robots", raising=False)
    module = importlib.import_module("imop.robots.universal_robots")
    monkeypatch.delitem(sys.modules, "imop.robots.universal_robots")
    monkeypatch.setattr(module, "POLL", 0.001)
    monkeypatch.setattr(module, "SETTLING", 0.05)
    monkeypatch.setattr(module, "UNLOCK_AFTER", 0.01)
    return module


@pytest.fixture(params=["franka", "universal"])
def arm(request):
    """An arm, and its line."""
    if request.param == "franka":
        robot = request.getfixturevalue("franka").FrankaRobot("arm", LIMITS, T_FLANGE_GRIPPER)
        return robot, robot._arm.line
    module = request.getfixturevalue("universal")
    robot = module.UniversalRobot("arm", LIMITS, T_FLANGE_GRIPPER, Fingers())
    return robot, request.getfixturevalue("controller").line


def test_the_gripper_goes_where_it_is_sent(arm):
    robot: Robot = arm[0]
    assert robot.move_to(GOAL).done
    state = robot.state()
    assert se3.near(state.T_base_gripper, GOAL, 1e-6, 1e-6)
    for opening in (0.5, 1.0, 0.0):
        assert robot.move_gripper(opening).done
        assert robot.state().gripper_opening == pytest.approx(opening)
    assert robot.state().stamp > state.stamp


def test_a_stop_ends_the_motion_and_the_next_one_is_done(arm):
    robot, line = arm
    step, steps = line.step, []

    def stopping():
        steps.append(step())
        if len(steps) == 2:
            robot.stop()

    line.step = stopping
    assert robot.move_to(GOAL).reason == "stopped"
    assert not se3.near(robot.state().T_base_gripper, GOAL, 0.05, 3.0)
    line.step = step
    assert robot.move_to(GOAL).done


def test_what_stops_the_arm_is_a_reason_and_after_recovery_one_goes_on(arm):
    robot, line = arm
    line.fails = True
    assert robot.move_to(GOAL).reason == "protective_stop"
    assert not robot.move_to(GOAL).done
    assert robot.recover().done
    assert robot.move_to(GOAL).done


def test_an_arm_that_does_not_come_there_says_how_far_it_is(arm, monkeypatch):
    monkeypatch.setattr("imop.robots.arrived.SETTLING", 0.01)
    robot, line = arm
    begin = line.begin
    line.begin = lambda T: begin(T @ se3.make(p=(0.0, 0.03, 0.0)))
    result = robot.move_to(GOAL)
    assert result.reason == "not_arrived" and "30 mm" in result.detail


def test_who_is_not_there_is_a_connection_error(franka, universal):
    with pytest.raises(ConnectionError, match="nowhere"):
        franka.FrankaRobot("nowhere", LIMITS, T_FLANGE_GRIPPER)
    with pytest.raises(ConnectionError, match="nowhere"):
        universal.UniversalRobot("nowhere", LIMITS, T_FLANGE_GRIPPER, Fingers())


def test_franka_keeps_to_the_lower_of_both_limits_and_knows_its_own_end_effector(franka):
    robot = franka.FrankaRobot("arm", Limits(speed=0.2, turn=9.0, joint_speed=3.0), T_FLANGE_GRIPPER)
    assert robot._arm.translation_velocity_limit.value == 0.2
    assert robot._arm.rotation_velocity_limit.value == 2.5
    assert np.all(robot._arm.joint_velocity_limit.value == 2.175)
    T_base_flange = robot._arm.line.T @ se3.invert(robot._arm.T_flange_ee)
    assert np.allclose(robot.state().T_base_gripper, T_base_flange @ T_FLANGE_GRIPPER)


def test_franka_closes_on_a_thing_and_that_is_no_failure(franka):
    robot = franka.FrankaRobot("arm", LIMITS, T_FLANGE_GRIPPER)
    robot._hand.blocked = 0.03
    assert robot.move_gripper(0.0).done and robot._hand.grasps == 1
    assert robot.state().gripper_opening == pytest.approx(0.03 / 0.08)


def test_a_lost_connection_is_a_result(franka):
    robot = franka.FrankaRobot("arm", LIMITS, T_FLANGE_GRIPPER)
    robot._arm.line.error = franka.franky.NetworkException("gone")
    assert robot.move_to(GOAL).reason == "disconnected"
    with pytest.raises(ConnectionError, match="gone"):
        robot.state()


def test_universal_robots_slow_down_where_they_turn(universal, controller):
    robot = universal.UniversalRobot("arm", LIMITS, T_FLANGE_GRIPPER, Fingers())
    controller.line.T = se3.make(p=(0.3, 0.0, 0.3))
    assert robot.move_to(se3.make(p=(0.3, 0.4, 0.3))).done and controller.speed == LIMITS.speed
    assert robot.move_to(se3.make(se3.euler(z=2.0), (0.3, 0.3, 0.3))).done
    seconds = 0.1 / controller.speed
    assert 2.0 / seconds == pytest.approx(LIMITS.turn)


def test_universal_robots_refuse_what_is_out_of_reach_and_an_emergency_stop(universal, controller):
    robot = universal.UniversalRobot("arm", LIMITS, T_FLANGE_GRIPPER, Fingers())
    controller.safe = False
    assert robot.move_to(GOAL).reason == "unreachable"
    controller.safe, controller.emergency = True, True
    assert robot.move_to(GOAL).reason == "not_ready" and robot.recover().reason == "not_ready"
    controller.emergency, controller.connected = False, False
    assert robot.recover().reason == "disconnected"
    with pytest.raises(ConnectionError):
        robot.state()


def test_close_gives_up_everything(universal, controller):
    fingers = Fingers()
    universal.UniversalRobot("arm", LIMITS, T_FLANGE_GRIPPER, fingers).close()
    assert fingers.closed and not controller.program


@pytest.mark.parametrize(
    ("module", "package", "extra"),
    [
        ("imop.robots.franka", "franky", "franka"),
        ("imop.robots.universal_robots", "rtde_control", "universal_robots"),
        ("imop.cameras.realsense", "pyrealsense2", "realsense"),
    ],
)
def test_a_missing_package_is_named_with_its_extra(module, package, extra, monkeypatch):
    monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.delitem(sys.modules, module, raising=False)
    with pytest.raises(MissingExtra, match=extra):
        importlib.import_module(module)


def test_threads_other_than_the_callers_may_stop(arm):
    robot, _ = arm
    thread = threading.Thread(target=robot.stop)
    thread.start()
    thread.join()
    assert robot.move_to(GOAL).done
