import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from imop.calibration.solvers import fit_scaled, mean_pose, starts
from imop.geometry import se3


def random_pose(rng, reach=1.0):
    return se3.make(Rotation.random(random_state=rng).as_matrix(), rng.uniform(-reach, reach, 3))


def equation(seed, n=10):
    """X, Y, A and M with A = inv(X) M Y."""
    rng = np.random.default_rng(seed)
    X, Y = random_pose(rng), random_pose(rng)
    M = np.stack([random_pose(rng) for _ in range(n)])
    return X, Y, se3.invert(X) @ M @ Y, M


@given(seed=st.integers(0, 999), scale=st.sampled_from([1.0, 0.001, 0.9, 1.2]))
def test_poses_and_the_scale_of_lengths_are_found(seed, scale):
    X, Y, A, M = equation(seed)
    given_M = M.copy()
    given_M[:, :3, 3] /= scale
    fit = fit_scaled(A, given_M)
    assert np.allclose(fit.X, X, atol=1e-6) and np.allclose(fit.Y, Y, atol=1e-6)
    assert np.isclose(fit.scale, scale) and fit.angle < 1e-6 and fit.distance < 1e-6


@pytest.mark.parametrize("seed", range(5))
def test_all_solvers_agree_where_nothing_is_noisy(seed):
    X, Y, A, M = equation(seed)
    found = list(starts(A, M))
    assert len(found) >= 6
    # Some of OpenCV's closed forms lose a few digits; none may mistake a direction.
    assert np.median([np.abs(T - X).max() for T, _ in found]) < 1e-6
    assert max(np.abs(T - Y).max() for _, T in found) < 1e-2


def test_one_wrong_pose_does_not_move_the_middle_far():
    rng = np.random.default_rng(0)
    T = random_pose(rng)
    poses = np.stack([T] * 9 + [T @ se3.make(p=(5.0, 0.0, 0.0))])
    assert np.allclose(mean_pose(poses), T)
