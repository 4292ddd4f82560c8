import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from imop.errors import InvalidInput
from imop.geometry import se3

vectors = arrays(np.float64, 3, elements=st.floats(-3, 3))


@st.composite
def poses(draw):
    return se3.make(se3.euler(*draw(vectors)), draw(vectors))


@given(poses(), poses(), arrays(np.float64, (4, 3), elements=st.floats(-3, 3)))
def test_composition_acts_as_successive_application(T_a_b, T_b_c, p_c):
    np.testing.assert_allclose(
        se3.apply(T_a_b @ T_b_c, p_c), se3.apply(T_a_b, se3.apply(T_b_c, p_c)), atol=1e-12
    )


@given(poses())
def test_inverse(T):
    np.testing.assert_allclose(T @ se3.invert(T), np.eye(4), atol=1e-12)


@given(poses())
def test_pose7_round_trip(T):
    np.testing.assert_allclose(se3.from_pose7(se3.to_pose7(T)), T, atol=1e-12)


@given(poses(), poses(), poses())
def test_distances_do_not_depend_on_the_world_frame(T_a, T_b, T_world):
    moved = (T_world @ T_a, T_world @ T_b)
    np.testing.assert_allclose(se3.rotation_distance(*moved), se3.rotation_distance(T_a, T_b), atol=1e-6)
    np.testing.assert_allclose(
        se3.translation_distance(*moved), se3.translation_distance(T_a, T_b), atol=1e-9
    )


def test_quaternions_are_xyzw():
    T = se3.from_pose7(np.array([0, 0, 0, 0, 0, np.sin(0.25), np.cos(0.25)]))
    np.testing.assert_allclose(T[:3, :3], se3.euler(z=0.5), atol=1e-12)


@given(poses())
def test_mujoco_reads_its_quaternions(T):
    quaternion, R = se3.to_wxyz(T), np.empty(9)
    mujoco.mju_quat2Mat(R, quaternion)
    np.testing.assert_allclose(R.reshape(3, 3), T[:3, :3], atol=1e-12)
    np.testing.assert_allclose(se3.from_wxyz(-2 * quaternion), T[:3, :3], atol=1e-12)
    np.testing.assert_array_equal(quaternion[[1, 2, 3, 0]], se3.to_pose7(T)[3:])


def test_batches(rng):
    T = se3.from_pose7(np.concatenate([rng.normal(size=(2, 5, 3)), np.tile([0, 0, 0, 1.0], (2, 5, 1))], -1))
    assert T.shape == (2, 5, 4, 4)
    assert se3.to_pose7(se3.invert(T)).shape == (2, 5, 7)
    assert se3.apply(T, rng.normal(size=(2, 5, 6, 3))).shape == (2, 5, 6, 3)
    assert (
        se3.from_wxyz(se3.to_wxyz(T)).shape
        == se3.from_wxyz(se3.to_wxyz(T[..., :3, :3])).shape
        == (2, 5, 3, 3)
    )
    assert se3.rotation_distance(T, T).shape == (2, 5)


@pytest.mark.parametrize("pose", [np.zeros(6), np.array([0, 0, 0, 0, 0, 0, 2.0]), np.zeros(7), np.array(1.0)])
def test_bad_poses_are_named(pose):
    with pytest.raises(InvalidInput, match="pose"):
        se3.from_pose7(pose)


def test_near_asks_for_both_the_place_and_the_turn():
    here = se3.make(p=(0.1, 0.2, 0.3))
    others = np.stack(
        [here @ se3.make(se3.euler(z=turn), (x, 0, 0)) for x, turn in ((0, 0), (0.02, 0), (0, 0.2))]
    )
    assert se3.near(others, here, 0.01, 0.1).tolist() == [True, False, False]
    assert se3.near(others, here, 0.03, 0.3).all()
