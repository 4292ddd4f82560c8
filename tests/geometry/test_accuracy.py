import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from imop.geometry import se3
from imop.geometry.accuracy import COARSE, FINE, errors

RIGHT = se3.make(se3.euler(0.2, -0.4, 1.0), (0.3, -0.1, 0.9))
seeds = st.integers(0, 10_000)


def near(rng, count):
    """Poses some centimetres and degrees from `RIGHT`."""
    offsets = [se3.make(se3.euler(*rng.normal(0, 0.2, 3)), rng.normal(0, 0.03, 3)) for _ in range(count)]
    return RIGHT @ np.stack(offsets)


@given(seeds)
def test_no_right_pose_is_nearer_both_in_place_and_in_rotation(seed):
    poses = near(np.random.default_rng(seed), 6)
    metres, radians = errors(RIGHT, poses)
    distances, angles = se3.translation_distance(RIGHT, poses), se3.rotation_distance(RIGHT, poses)
    assert ((distances == metres) & (angles == radians)).any()
    assert not ((distances < metres) & (angles < radians)).any()


@given(seeds)
def test_the_order_of_the_right_poses_does_not_matter(seed):
    poses = near(np.random.default_rng(seed), 6)
    assert errors(RIGHT, poses[::-1]) == errors(RIGHT, poses)


@pytest.mark.parametrize(("shift", "nearest"), [(0.009, "shifted"), (0.011, "turned")])
def test_a_centimetre_weighs_as_much_as_five_degrees(shift, nearest):
    poses = RIGHT @ np.stack([se3.make(p=(shift, 0, 0)), se3.make(se3.euler(z=np.radians(5)))])
    metres, radians = errors(RIGHT, poses)
    assert (metres > 0.001) == (nearest == "shifted")
    assert (radians > 0.001) == (nearest == "turned")


def test_of_poses_with_the_same_larger_error_the_one_with_the_smaller_other_error_counts():
    turned, plain = (se3.make(se3.euler(z=angle), (0.03, 0, 0)) for angle in (0.2, 0.0))
    assert errors(np.eye(4), np.stack([turned, plain])) == (0.03, 0.0)


def test_the_limits_weigh_both_errors_alike():
    assert FINE[1] / FINE[0] == COARSE[1] / COARSE[0]
