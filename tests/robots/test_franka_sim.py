"""The Franka driver on franka-sim, which serves libfranka's protocol; skipped without a server.

Start `run-franka-sim-server` in an environment of its own (docs/real_robot/robots.md says how), and run this
file there with IMOP_FRANKA_SIM=127.0.0.1.
"""

import os
import threading
import time

import numpy as np
import pytest

from imop.geometry import se3
from imop.robots.guarded import GuardedRobot
from imop.robots.limits import Limits
from imop.robots.panda import T_FLANGE_TIP

ADDRESS = os.environ.get("IMOP_FRANKA_SIM", "")
if not ADDRESS:
    pytest.skip("no franka-sim is named by IMOP_FRANKA_SIM", allow_module_level=True)
pytest.importorskip("franky", reason="franky-control is not installed")

from imop.robots.franka import FrankaRobot  # noqa: E402 (only where there is franky)

DOWN = np.diag([-1.0, 1.0, -1.0])
LIMITS = Limits(speed=0.25, turn=1.0, joint_speed=1.0)


@pytest.fixture(scope="module")
def driver():
    robot = FrankaRobot(ADDRESS, LIMITS, T_FLANGE_TIP, realtime=False)
    yield robot
    robot.close()


@pytest.fixture
def robot(driver):
    driver.recover()
    guarded = GuardedRobot(driver, np.eye(4), np.array([0.2, -0.5, 0.1]), np.array([0.7, 0.5, 0.8]), LIMITS)
    assert guarded.move_to(se3.make(DOWN, (0.45, 0.0, 0.45))).done
    return guarded


def test_it_goes_where_it_is_told_and_no_faster_than_allowed(robot):
    before = robot.state()
    goal = se3.make(DOWN @ se3.euler(z=0.4), (0.5, 0.15, 0.35))
    assert robot.move_to(goal).done
    after = robot.state()
    assert se3.near(after.T_base_gripper, goal, 0.006, 0.05)
    way = float(se3.translation_distance(before.T_base_gripper, after.T_base_gripper))
    assert way / (after.stamp - before.stamp) < LIMITS.speed


def test_it_opens_and_closes(robot):
    for opening in (1.0, 0.5, 1.0, 0.0):
        assert robot.move_gripper(opening).done
        assert robot.state().gripper_opening == pytest.approx(opening, abs=0.1)


def test_a_stop_from_another_thread_ends_the_motion_and_one_can_go_on(robot):
    goal = se3.make(DOWN, (0.45, -0.4, 0.45))
    threading.Timer(1.0, robot.stop).start()
    assert robot.move_to(goal).reason == "stopped"
    halted = robot.state()
    assert not se3.near(halted.T_base_gripper, goal, 0.1, 0.5)
    time.sleep(0.3)
    assert se3.near(robot.state().T_base_gripper, halted.T_base_gripper, 0.002, 0.01)
    assert robot.move_to(goal).done


def test_what_the_arm_refuses_is_a_result_and_the_connection_lives_on(driver, robot):
    assert robot.move_to(se3.make(DOWN, (0.45, 0.0, 0.05))).reason == "outside_workspace"
    beyond = driver.move_to(se3.make(DOWN, (1.3, 0.0, 0.3)))
    assert not beyond.done and beyond.reason in ("protective_stop", "not_ready", "not_arrived")
    assert robot.recover().done
    # Out of a singularity no line leads: the server, as a real arm, has to be brought home otherwise.
    again = robot.move_to(se3.make(DOWN, (0.45, 0.0, 0.4)))
    assert again.done or "singular" in again.detail
