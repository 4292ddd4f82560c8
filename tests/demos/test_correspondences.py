import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from imop.demos.correspondences import correspondences
from imop.errors import InvalidInput
from imop.geometry import se3


def pose(rng):
    return se3.make(se3.euler(*rng.uniform(-np.pi, np.pi, 3)), rng.uniform(-0.5, 0.5, 3))


def grid(n=5, step=0.03):
    return step * np.stack(np.meshgrid(*[np.arange(n)] * 3), axis=-1).reshape(-1, 3).astype(float)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_points_that_moved_with_the_action_find_themselves(seed):
    rng = np.random.default_rng(seed)
    T_support, T_query = pose(rng), pose(rng)
    p = grid()
    order = rng.permutation(len(p))
    query = se3.apply(T_query @ se3.invert(T_support), p)[order] + rng.uniform(-0.004, 0.004, p.shape)
    pairs = correspondences(p, T_support, query, T_query)
    assert len(pairs) == len(p)
    np.testing.assert_array_equal(order[pairs[:, 1]], pairs[:, 0])


def test_hidden_points_have_no_pair():
    p, T = grid(), np.eye(4)
    seen = np.flatnonzero(p[:, 0] < 0.07)
    pairs = correspondences(p, T, p[seen], T)
    np.testing.assert_array_equal(pairs[:, 0], seen)
    np.testing.assert_array_equal(pairs[:, 1], np.arange(len(seen)))


@pytest.mark.parametrize("turn", [np.pi / 2, np.pi, 1.0])
def test_of_a_symmetric_object_one_motion_explains_all_pairs(turn):
    angles = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    p = np.column_stack([0.05 * np.cos(angles), 0.05 * np.sin(angles), np.zeros(40)])
    # The can was also turned about its axis, which nobody can see; the action was not.
    query = se3.apply(se3.make(se3.euler(z=turn)), p)
    pairs = correspondences(p, np.eye(4), query, np.eye(4))
    assert len(set(pairs[:, 0])) == len(set(pairs[:, 1])) == len(pairs) > 30
    assert np.linalg.norm(p[pairs[:, 0]] - query[pairs[:, 1]], axis=1).max() < 0.01


def test_nothing_matches_nothing():
    nothing = np.zeros((0, 3))
    assert correspondences(nothing, np.eye(4), grid(), np.eye(4)).shape == (0, 2)
    assert correspondences(grid(), np.eye(4), nothing, np.eye(4)).shape == (0, 2)


def test_a_radius_of_nothing_is_refused():
    with pytest.raises(InvalidInput, match="radius"):
        correspondences(grid(), np.eye(4), grid(), np.eye(4), radius=0.0)
