import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.robots.interfaces import DONE, REASONS, MotionResult, RobotState


@pytest.mark.parametrize("joints", [1, 6, 7])
def test_a_state_of_any_number_of_joints_is_kept_as_given(joints):
    T = se3.make(se3.euler(z=0.3), (0.1, 0.2, 0.3))
    state = RobotState(T, 0.5, np.arange(joints), stamp=3)
    np.testing.assert_array_equal(state.T_base_gripper, T)
    np.testing.assert_array_equal(state.joint_positions, np.arange(joints))
    assert (state.gripper_opening, state.stamp) == (0.5, 3.0)


@given(st.floats(-0.01, 1.01))
def test_an_opening_that_is_measured_a_little_outside_is_clipped(opening):
    state = RobotState(np.eye(4), opening, np.zeros(6))
    assert state.gripper_opening == min(max(opening, 0.0), 1.0)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("T_base_gripper", np.diag([1.0, 1.0, -1.0, 1.0])),
        ("T_base_gripper", np.full((4, 4), np.nan)),
        ("gripper_opening", 80.0),
        ("gripper_opening", np.nan),
        ("joint_positions", [[0.0]]),
        ("joint_positions", [np.inf]),
        ("stamp", np.nan),
    ],
)
def test_what_no_arm_measures_is_refused_by_name(field, value):
    good = {"T_base_gripper": np.eye(4), "gripper_opening": 1.0, "joint_positions": np.zeros(7), "stamp": 0.0}
    with pytest.raises(InvalidInput, match=field):
        RobotState(**{**good, field: value})


def test_a_state_cannot_be_changed():
    state = RobotState(np.eye(4), 1.0, np.zeros(7))
    with pytest.raises(dataclasses.FrozenInstanceError):
        state.stamp = 1.0
    with pytest.raises(ValueError, match="read-only"):
        state.joint_positions[0] = 1.0


def test_a_result_has_a_reason_exactly_if_it_is_not_done():
    assert DONE.done and DONE.reason is None
    for reason in REASONS:
        assert not MotionResult(False, reason).done
        with pytest.raises(InvalidInput, match="reason"):
            MotionResult(True, reason)
    for reason in (None, "tired"):
        with pytest.raises(InvalidInput, match="reason"):
            MotionResult(False, reason)
