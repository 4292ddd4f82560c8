import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from imop.cameras.interfaces import Frame
from imop.errors import InvalidInput
from imop.geometry import se3
from imop.robots.interfaces import RobotState
from imop.setup.file import from_dict
from imop.setup.setup import GripperSetup

K = {"fx": 6, "fy": 6, "cx": 4, "cy": 3}
BASE = se3.make(se3.euler(z=0.4), (0.3, 0.1, 0.7))
POSE = {"position": [0.1, 0, -0.1], "quaternion": [0, 0, 0, 1]}


def setup():
    fields = {
        "robot": {"model": "panda", "home": [0.0] * 7, "T_world_base": BASE.tolist()},
        "workspace": {"lower": [-1, -1, -1], "upper": [1, 1, 1], "table_height": 0},
        "cameras": {
            "serial123": {"size": [8, 6], "intrinsics": K, "T_world_camera": POSE, "seen_as": "front"},
            "wrist": {"size": [8, 6], "intrinsics": K, "T_gripper_camera": POSE},
        },
    }
    return from_dict(fields)


def frame(width=8, height=6):
    K_ = np.array([[6.0, 0, 4], [0, 6, 3], [0, 0, 1]])
    return Frame(np.zeros((height, width, 3), np.uint8), np.ones((height, width)), K_)


def test_a_camera_on_the_gripper_moves_with_it_and_one_beside_it_does_not():
    seen = []
    for x in (0.2, 0.5):
        T_base_gripper = se3.make(se3.euler(x=3.0), (x, 0, 0.3))
        state = RobotState(T_base_gripper, 1.0, np.zeros(7))
        observation = setup().observation(state, {"serial123": frame(), "wrist": frame()}, 2)
        np.testing.assert_allclose(observation.T_world_gripper, BASE @ T_base_gripper)
        assert set(observation.views) == {"front", "wrist"} and observation.time_step == 2
        seen.append(observation)
    standing, moving = ([o.views[name].T_world_camera for o in seen] for name in ("front", "wrist"))
    np.testing.assert_array_equal(standing[0], standing[1])
    np.testing.assert_allclose(moving[1][:3, 3] - moving[0][:3, 3], BASE[:3, :3] @ (0.3, 0, 0))


@pytest.mark.parametrize(
    ("frames", "joints", "field"),
    [
        ({"wrist": frame()}, 7, "frames"),
        ({"front": frame(), "wrist": frame()}, 7, "frames"),
        ({"serial123": frame(6, 8), "wrist": frame()}, 7, "frames.serial123"),
        ({"serial123": frame(), "wrist": frame()}, 6, "joint_positions"),
    ],
)
def test_what_does_not_fit_the_set_up_is_named(frames, joints, field):
    with pytest.raises(InvalidInput) as raised:
        setup().observation(RobotState(np.eye(4), 1.0, np.zeros(joints)), frames)
    assert raised.value.field == field


@given(st.tuples(*[st.floats(-3, 3)] * 3), st.booleans())
def test_the_gripper_frame_points_where_the_fingers_do(angles, flipped):
    R = se3.euler(*angles)
    gripper = GripperSetup(0.08, R @ (0, 0, 0.1), R[:, 2], (-1 if flipped else 1) * 2 * R[:, 1])
    T = gripper.T_flange_gripper
    np.testing.assert_allclose(T[:3, 2], R[:, 2], atol=1e-12)
    np.testing.assert_allclose(np.abs(T[:3, 1] @ R[:, 1]), 1, atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(T[:3, :3]), 1)


def test_a_hand_that_closes_in_the_direction_it_points_is_refused():
    with pytest.raises(InvalidInput, match="closing"):
        GripperSetup(0.08, (0, 0, 0.1), (0, 0, 1), (0, 0.2, 1))
