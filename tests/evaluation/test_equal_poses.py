import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from imop.evaluation.equal_poses import equal_poses, held
from imop.geometry import se3
from imop.geometry.accuracy import errors
from imop.types import Action, Demonstration, Keyframe, Observation
from tests.policy.scenes import camera

QUARTER = np.stack([se3.make(se3.euler(z=k * np.pi / 2)) for k in range(4)])
HALF_TURN = se3.make(se3.euler(z=np.pi))
NEAR, TURNED = 0.001, np.radians(0.1)


class Looks:
    """An appearance that is said, not measured."""

    def __init__(self, turns=None, alike=()):
        self._turns, self._alike = turns or {}, {frozenset(pair) for pair in alike}

    def turns(self, body):
        return self._turns.get(body, np.eye(4)[None])

    def alike(self, body, other):
        return frozenset((body, other)) in self._alike


def placed(x, y, yaw=0.3):
    return se3.make(se3.euler(z=yaw), (x, y, 0.8))


HERE = {"cube": placed(0.2, 0.1), "twin": placed(0.0, -0.2, 1.0), "plate": placed(0.3, -0.1, 2.0)}
FROM_ABOVE = se3.make(np.diag([-1.0, 1.0, -1.0]), (0.01, 0.0, 0.0))


def recording(*steps, opening=0.5):
    """Keyframes of (object, gripper open after it); closed fingers are `opening` apart."""
    keyframes, is_open = [], True
    for name, opens in steps:
        T = HERE[name] @ FROM_ABOVE
        observation = Observation({"top": camera()}, T, 1.0 if is_open else opening)
        keyframes.append(Keyframe(observation, Action(T, opens), name, HERE[name]))
        is_open = opens
    return Demonstration(tuple(keyframes), keyframes[-1].observation)


PICK = recording(("cube", True), ("cube", False), ("cube", False), ("plate", True), ("plate", True))


def right(T, recorded, step, looks):
    position, rotation = errors(T, equal_poses(recorded, step, looks))
    return position < NEAR and rotation < TURNED


def test_what_is_in_the_hand():
    assert [held(PICK, step) for step in range(5)] == [None, None, 1, 1, None]


def test_closed_fingers_that_meet_hold_nothing():
    pushing = recording(("cube", False), ("cube", False), ("cube", False), opening=0.0)
    assert [held(pushing, step) for step in range(3)] == [None, None, None]


@pytest.mark.parametrize("step", range(5))
def test_the_recorded_pose_is_right(step):
    T = PICK.keyframes[step].action.T_world_gripper
    assert np.array_equal(equal_poses(PICK, step, None), T[None])
    assert np.allclose(equal_poses(PICK, step, Looks())[0], T)
    assert right(T, PICK, step, Looks())


@pytest.mark.parametrize(("step", "empty"), [(0, True), (1, True), (2, False), (3, False), (4, True)])
def test_half_a_turn_of_the_gripper_counts_while_it_is_empty(step, empty):
    T = PICK.keyframes[step].action.T_world_gripper @ HALF_TURN
    assert right(T, PICK, step, Looks()) == empty
    assert not right(T, PICK, step, None)


@pytest.mark.parametrize("quarter", range(4))
def test_turns_of_the_object_count_where_they_cannot_be_seen(quarter):
    turn = HERE["cube"] @ QUARTER[quarter] @ se3.invert(HERE["cube"])
    T = turn @ PICK.keyframes[1].action.T_world_gripper
    assert right(T, PICK, 1, Looks({"cube": QUARTER}))
    # Half a turn of this cube moves the gripper, too: it is not held in its middle.
    assert right(T, PICK, 1, Looks()) == (quarter == 0)


@pytest.mark.parametrize("quarter", range(4))
def test_what_is_held_may_be_put_down_turned(quarter):
    T_gripper_cube = se3.invert(FROM_ABOVE)
    T = PICK.keyframes[3].action.T_world_gripper @ T_gripper_cube @ QUARTER[quarter] @ FROM_ABOVE
    assert right(T, PICK, 3, Looks({"cube": QUARTER}))
    assert right(T, PICK, 3, Looks()) == (quarter == 0)


def at_twin(recorded, step):
    return HERE["twin"] @ se3.invert(HERE["cube"]) @ recorded.keyframes[step].action.T_world_gripper


def test_equal_objects_count_only_if_the_task_uses_both():
    looks = Looks(alike=[("cube", "twin")])
    both = recording(("cube", True), ("cube", False), ("plate", True), ("twin", True), ("twin", False))
    assert right(at_twin(both, 0), both, 0, looks)
    assert not right(at_twin(both, 0), both, 0, Looks())
    # The cube was approached; and later the other one is all that is left.
    assert not right(at_twin(both, 1), both, 1, looks)
    first = HERE["cube"] @ se3.invert(HERE["twin"]) @ both.keyframes[3].action.T_world_gripper
    assert not right(first, both, 3, looks)
    # A task that never turns to the twin wants the cube.
    assert not right(at_twin(PICK, 0), PICK, 0, looks)


directions = st.tuples(*[st.floats(-1, 1)] * 3).map(np.array).filter(lambda v: np.linalg.norm(v) > 0.1)


@given(directions, st.integers(0, 4))
def test_a_pose_three_centimetres_off_is_three_centimetres_off(direction, step):
    recorded = PICK.keyframes[step].action.T_world_gripper
    shift = 0.03 * direction / np.linalg.norm(direction)
    position, rotation = errors(se3.make(p=shift) @ recorded, equal_poses(PICK, step, Looks()))
    assert position == pytest.approx(0.03) and rotation < 1e-6


@given(st.floats(0.02, 0.7), st.integers(0, 4))
def test_a_turned_gripper_is_turned(angle, step):
    T = PICK.keyframes[step].action.T_world_gripper @ se3.make(se3.euler(z=angle))
    position, rotation = errors(T, equal_poses(PICK, step, Looks()))
    assert position < 1e-9 and rotation == pytest.approx(angle)
