import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.geometry.procrustes import robust_procrustes, weighted_procrustes

seeds = st.integers(0, 10_000)


def random_pose(rng):
    return torch.from_numpy(se3.make(se3.euler(*rng.uniform(-3, 3, 3)), rng.normal(size=3)))


def apply(T, x):
    return x @ T[..., :3, :3].mT + T[..., None, :3, 3]


@given(seeds, st.integers(3, 20))
def test_recovers_the_motion(seed, count):
    rng = np.random.default_rng(seed)
    T, x = random_pose(rng), torch.from_numpy(rng.normal(size=(count, 3)))
    fit = weighted_procrustes(x, apply(T, x), torch.from_numpy(rng.uniform(0.1, 1, count)))
    assert fit.unique
    torch.testing.assert_close(fit.T_y_x, T, atol=1e-9, rtol=0)


@given(seeds)
def test_equivariant_to_motions_of_either_side(seed):
    rng = np.random.default_rng(seed)
    x, y = (torch.from_numpy(rng.normal(size=(12, 3))) for _ in range(2))
    A, B = random_pose(rng), random_pose(rng)
    moved = weighted_procrustes(apply(A, x), apply(B, y)).T_y_x
    torch.testing.assert_close(moved, B @ weighted_procrustes(x, y).T_y_x @ A.inverse(), atol=1e-7, rtol=0)


@given(seeds)
def test_never_reflects_and_is_optimal_nearby(seed):
    rng = np.random.default_rng(seed)
    x = torch.from_numpy(rng.normal(size=(8, 3)))
    y = x * torch.tensor([1.0, 1.0, -1.0])
    T = weighted_procrustes(x, y).T_y_x
    assert torch.linalg.det(T[:3, :3]) == pytest.approx(1, abs=1e-9)
    cost = (apply(T, x) - y).square().sum()
    for _ in range(10):
        nudge = torch.from_numpy(se3.make(se3.euler(*rng.normal(0, 0.05, 3)), rng.normal(0, 0.05, 3)))
        assert (apply(nudge @ T, x) - y).square().sum() >= cost - 1e-9


def test_zero_weights_ignore_outliers(rng):
    T, x = random_pose(rng), torch.from_numpy(rng.normal(size=(10, 3)))
    y = apply(T, x)
    y[7:] += 5
    weights = torch.ones(10, dtype=torch.float64)
    weights[7:] = 0
    torch.testing.assert_close(weighted_procrustes(x, y, weights).T_y_x, T, atol=1e-9, rtol=0)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_planar_points_are_unique(rng, dtype):
    T, x = random_pose(rng).to(dtype), torch.from_numpy(rng.normal(size=(9, 3))).to(dtype)
    x[:, 2] = 0
    fit = weighted_procrustes(x, apply(T, x))
    assert fit.rank == 2
    torch.testing.assert_close(fit.T_y_x, T, atol=1e-5, rtol=0)


@pytest.mark.parametrize("turn", [0.0, 0.7, np.pi])
def test_collinear_points_take_the_smallest_rotation(turn):
    direction = torch.tensor([1.0, 0.0, 0.0], dtype=torch.float64)
    steps = torch.linspace(-1, 1, 5, dtype=torch.float64)[:, None]
    R = torch.from_numpy(se3.euler(z=turn))
    fit = weighted_procrustes(steps * direction + 2, steps * (R @ direction) - 1)
    assert fit.rank == 1 and not fit.unique
    assert se3.rotation_distance(fit.T_y_x.numpy(), np.eye(4)) == pytest.approx(turn, abs=1e-6)
    torch.testing.assert_close(apply(fit.T_y_x, steps * direction + 2), steps * (R @ direction) - 1)


def test_coincident_points_only_translate():
    x = torch.full((4, 3), 0.3, dtype=torch.float64)
    fit = weighted_procrustes(x, x + 1)
    assert fit.rank == 0
    torch.testing.assert_close(fit.T_y_x[:3, :3], torch.eye(3, dtype=torch.float64))
    torch.testing.assert_close(fit.T_y_x[:3, 3], torch.ones(3, dtype=torch.float64))


def test_a_single_point_only_translates():
    x = torch.zeros(1, 3, dtype=torch.float64)
    assert weighted_procrustes(x, x + 1).rank == 0


def test_empty_and_weightless_are_the_identity():
    nothing = torch.zeros(0, 3, dtype=torch.float64)
    some = torch.rand(5, 3, dtype=torch.float64)
    weightless = weighted_procrustes(some, some + 1, torch.zeros(5, dtype=torch.float64))
    for fit in (weighted_procrustes(nothing, nothing), weightless):
        assert fit.rank == -1
        torch.testing.assert_close(fit.T_y_x, torch.eye(4, dtype=torch.float64))


def test_batches_mix_degenerate_and_good(rng):
    x = torch.from_numpy(rng.normal(size=(3, 2, 6, 3)))
    x[1, 0] = 0.5
    y = x + 1
    fit = weighted_procrustes(x, y)
    assert fit.T_y_x.shape == (3, 2, 4, 4) and fit.rank.shape == (3, 2)
    assert fit.rank[1, 0] == 0 and fit.unique.sum() == 5
    for index in np.ndindex(3, 2):
        torch.testing.assert_close(fit.T_y_x[index], weighted_procrustes(x[index], y[index]).T_y_x)


def test_gradients_against_finite_differences(rng):
    x, y = (torch.from_numpy(rng.normal(size=(5, 3))).requires_grad_() for _ in range(2))
    weights = torch.from_numpy(rng.uniform(0.2, 1, 5)).requires_grad_()
    assert torch.autograd.gradcheck(lambda *a: weighted_procrustes(*a).T_y_x, (x, y, weights))


def test_gradients_stay_finite_where_the_motion_is_not_unique():
    x = torch.zeros(2, 4, 3, dtype=torch.float64)
    x[1, :, 0] = torch.arange(4)
    x.requires_grad_()
    weighted_procrustes(x, x.detach() + 1).T_y_x.sum().backward()
    assert torch.isfinite(x.grad).all()


@pytest.mark.parametrize(
    ("x", "y", "weights", "field"),
    [
        (torch.zeros(4, 2), torch.zeros(4, 2), None, "x, y"),
        (torch.zeros(4, 3), torch.zeros(5, 3), None, "x, y"),
        (torch.full((4, 3), torch.nan), torch.zeros(4, 3), None, "x, y"),
        (torch.zeros(4, 3), torch.zeros(4, 3), -torch.ones(4), "weights"),
        (torch.zeros(4, 3), torch.zeros(4, 3), torch.ones(3), "weights"),
    ],
)
def test_bad_input_is_named(x, y, weights, field):
    with pytest.raises(InvalidInput, match=field):
        weighted_procrustes(x, y, weights)


@given(seeds)
def test_the_same_with_and_without_gradients(seed):
    rng = np.random.default_rng(seed)
    x, y = (torch.from_numpy(rng.normal(size=(6, 3))) for _ in range(2))
    plain = weighted_procrustes(x, y)
    watched = weighted_procrustes(x.clone().requires_grad_(), y)
    torch.testing.assert_close(watched.T_y_x.detach(), plain.T_y_x, atol=1e-6, rtol=0)
    assert torch.equal(watched.rank, plain.rank)


@given(seeds)
def test_the_robust_fit_takes_no_notice_of_few_wrong_pairs(seed):
    rng = np.random.default_rng(seed)
    T, x = random_pose(rng), torch.from_numpy(rng.normal(size=(40, 3)))
    y = apply(T, x)
    y[:8] += torch.from_numpy(rng.normal(size=(8, 3)))
    found = robust_procrustes(x, y, torch.ones(40, dtype=torch.float64), (1.0, 0.3, 0.1, 0.03, 0.01))
    torch.testing.assert_close(found, T, atol=1e-3, rtol=0)


def test_the_robust_fit_is_least_squares_without_reaches_and_never_nan(rng):
    x, y = (torch.from_numpy(rng.normal(size=(3, 9, 3))) for _ in range(2))
    weights = torch.from_numpy(rng.uniform(0.2, 1, (3, 9)))
    expected = weighted_procrustes(x, y, weights).T_y_x
    torch.testing.assert_close(robust_procrustes(x, y, weights, ()), expected, atol=1e-9, rtol=0)
    assert torch.isfinite(robust_procrustes(x, y, torch.zeros_like(weights), (0.1,))).all()
