"""Inverse kinematics of the Panda against its forward kinematics."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.robots.panda import JOINT_LOWER, JOINT_UPPER, PANDA_HOME_Q, tip_pose
from imop.sim.kinematics import follow, inverse_kinematics, line, reachable, tip_and_jacobian

CONFIGURATIONS = st.integers(0, 10_000).map(
    lambda seed: np.random.default_rng(seed).uniform(JOINT_LOWER + 0.02, JOINT_UPPER - 0.02)
)


@given(CONFIGURATIONS)
def test_every_solution_reaches_the_pose_within_the_limits(q: np.ndarray) -> None:
    T = tip_pose(q)
    solutions = inverse_kinematics(T, PANDA_HOME_Q)
    assert len(solutions) > 0
    for solution in solutions[::7]:
        assert np.all(solution >= JOINT_LOWER) and np.all(solution <= JOINT_UPPER)
        reached = tip_pose(solution)
        assert se3.translation_distance(reached, T) < 1e-6
        assert se3.rotation_distance(reached, T) < 1e-6


@given(CONFIGURATIONS)
def test_solutions_come_nearest_first(q: np.ndarray) -> None:
    solutions = inverse_kinematics(tip_pose(q), q)
    distances = np.linalg.norm(solutions - q, axis=1)
    assert np.all(np.diff(distances) >= 0)
    assert np.array_equal(inverse_kinematics(tip_pose(q), q, limit=3), solutions[:3])


def test_the_home_pose_finds_the_home_configuration() -> None:
    nearest = inverse_kinematics(tip_pose(PANDA_HOME_Q), PANDA_HOME_Q)[0]
    assert np.abs(nearest - PANDA_HOME_Q).max() < 0.06, "within the sampling of joint 7"


def farthest(T: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """The pose where the arm stops when it moves away from `T`, to a micrometre."""
    near, far = 0.0, 2.0
    while far - near > 1e-6:
        middle = (near + far) / 2
        near, far = (middle, far) if reachable(se3.make(p=middle * direction) @ T) else (near, middle)
    return se3.make(p=near * direction) @ T


@given(CONFIGURATIONS, st.integers(0, 10_000))
def test_a_tenth_of_a_millimetre_inside_the_workspace_is_reached(q: np.ndarray, seed: int) -> None:
    direction = np.random.default_rng(seed).normal(size=3)
    direction /= np.linalg.norm(direction)
    edge = farthest(tip_pose(q), direction)
    for back in (5e-5, 1e-4, 2e-4):
        assert reachable(se3.make(p=-back * direction) @ edge)


@given(CONFIGURATIONS, st.integers(0, 6), st.booleans())
def test_poses_with_a_joint_near_its_limit_are_reached(q: np.ndarray, joint: int, upper: bool) -> None:
    q[joint] = JOINT_UPPER[joint] - 1e-4 if upper else JOINT_LOWER[joint] + 1e-4
    assert reachable(tip_pose(q))


def test_beyond_reach_there_is_no_solution() -> None:
    assert inverse_kinematics(se3.make(p=(2.0, 0, 1.0)), PANDA_HOME_Q).shape == (0, 7)


def test_bad_pose_names_the_field() -> None:
    with pytest.raises(InvalidInput, match="T_world_gripper"):
        inverse_kinematics(np.ones((4, 4)), PANDA_HOME_Q)


@given(CONFIGURATIONS)
def test_jacobian_is_the_derivative_of_the_tip(q: np.ndarray) -> None:
    T, J = tip_and_jacobian(q)
    assert np.abs(T - tip_pose(q)).max() < 1e-9
    for i in range(7):
        h = 1e-6 * np.eye(7)[i]
        difference = tip_pose(q + h) - tip_pose(q - h)
        assert np.allclose(difference[:3, 3] / 2e-6, J[:3, i], atol=1e-5)
        spin = difference[:3, :3] @ T[:3, :3].T / 2e-6
        assert np.allclose((spin[2, 1], spin[0, 2], spin[1, 0]), J[3:, i], atol=1e-5)


def test_line_is_straight_and_turns_evenly() -> None:
    T_from = se3.make(se3.euler(0.1, 0.2, 0.3), (0.1, 0.2, 0.3))
    T_to = se3.make(se3.euler(1.0, -0.5, 2.0), (0.5, -0.2, 1.0))
    poses = line(T_from, T_to, 10)
    assert np.allclose(poses[-1], T_to)
    assert np.allclose(np.diff(poses[:, :3, 3], axis=0), (T_to - T_from)[:3, 3] / 10)
    turns = se3.rotation_distance(poses[:-1], poses[1:])
    assert np.allclose(turns, se3.rotation_distance(T_from, T_to) / 10)


def test_following_a_line_stays_on_one_branch() -> None:
    T_to = tip_pose(PANDA_HOME_Q) @ se3.make(se3.euler(z=0.5), (0.05, -0.1, 0.4))
    poses = line(tip_pose(PANDA_HOME_Q), T_to, 50)
    q = follow(poses, PANDA_HOME_Q)
    assert q is not None and q.shape == (50, 7)
    assert np.abs(np.diff(q, axis=0)).max() < 0.1
    for T, row in zip(poses, q, strict=True):
        assert se3.translation_distance(tip_pose(row), T) < 1e-4
        assert se3.rotation_distance(tip_pose(row), T) < 1e-3


def test_following_a_line_out_of_reach_fails() -> None:
    away = line(tip_pose(PANDA_HOME_Q), tip_pose(PANDA_HOME_Q) @ se3.make(p=(-2.0, 0, 0)), 100)
    assert follow(away, PANDA_HOME_Q) is None


def test_what_is_a_step_away_can_be_reached_and_what_is_two_metres_away_cannot():
    home = tip_pose(PANDA_HOME_Q)
    assert reachable(home @ se3.make(p=(0, 0, 0.05)))
    assert not reachable(se3.make(p=(2, 0, 0)) @ home)
