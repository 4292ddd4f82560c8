"""Motions from correspondences: they survive outliers, and equal instances are kept apart."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imop.geometry import se3
from imop.geometry.ransac import distinct, mutual_matches, sample_motions


def motion(rng, reach=0.5):
    return se3.make(Rotation.random(rng=rng).as_matrix(), rng.uniform(-reach, reach, 3))


def patch(rng, count=60):
    normals = rng.normal(size=(count, 3))
    return rng.uniform(-0.1, 0.1, (count, 3)), normals / np.linalg.norm(normals, axis=1, keepdims=True)


def test_true_motion_is_found_among_mostly_wrong_pairs(rng):
    x, n = patch(rng)
    T = motion(rng)
    y, m = se3.apply(T, x), se3.rotate(T, n)
    wrong = rng.permutation(len(x))[:40]
    y[wrong], m[wrong] = rng.uniform(-1, 1, (40, 3)), n[rng.permutation(40)]
    found = sample_motions(x, y, n, m, np.ones(len(x)))
    assert se3.translation_distance(found[0], T) < 1e-6
    assert se3.rotation_distance(found[0], T) < 1e-6


def test_two_instances_give_two_motions_and_never_their_average(rng):
    x, n = patch(rng)
    left, right = se3.make(p=(0, -0.3, 0)), se3.make(se3.euler(z=0.5), (0, 0.3, 0))
    half = np.arange(len(x)) % 2 == 0
    y = np.where(half[:, None], se3.apply(left, x), se3.apply(right, x))
    m = np.where(half[:, None], se3.rotate(left, n), se3.rotate(right, n))
    found = sample_motions(x, y, n, m, np.ones(len(x)))[:2]
    for truth in (left, right):
        assert min(se3.translation_distance(T, truth) + se3.rotation_distance(T, truth) for T in found) < 1e-6


def test_same_seed_same_motions(rng):
    x, n = patch(rng)
    y = se3.apply(motion(rng), x) + rng.normal(0, 0.005, x.shape)
    runs = [sample_motions(x, y, n, n, np.ones(len(x)), seed=3) for _ in range(2)]
    np.testing.assert_array_equal(*runs)


@pytest.mark.parametrize("count", [0, 2])
def test_fewer_than_three_pairs_give_nothing(count):
    z = np.zeros((count, 3))
    assert sample_motions(z, z, z, z, np.ones(count)).shape == (0, 4, 4)


def test_inconsistent_pairs_give_nothing(rng):
    x, n = patch(rng, 12)
    assert len(sample_motions(x, 50 * x, n, n, np.ones(12))) == 0


def test_descriptors_find_their_permuted_copies(rng):
    features = rng.normal(size=(40, 33))
    order = rng.permutation(40)
    pairs = mutual_matches(features, features[order])
    assert len(pairs) == 40
    np.testing.assert_array_equal(order[pairs.i_query], pairs.i_support)
    assert np.all(pairs.weight > 0.5)


def test_ambiguous_descriptors_weigh_less(rng):
    features = rng.normal(size=(10, 33))
    noisy = features + 0.1 * rng.normal(size=features.shape)
    pairs = mutual_matches(features, np.concatenate([noisy, features[:5] + 0.1]))
    assert pairs.weight[pairs.i_support < 5].max() < pairs.weight[pairs.i_support >= 5].min()


def test_distinct_keeps_the_first_of_each_kind():
    center = np.array([1.0, 0, 0])
    near = se3.make(p=(0.005, 0, 0))
    turned = se3.make(se3.euler(z=0.5), center - se3.euler(z=0.5) @ center)
    motions = np.stack([np.eye(4), near, se3.make(p=(0.1, 0, 0)), turned])
    assert distinct(motions, center, keep=10) == [0, 2, 3]
    assert distinct(motions, center, keep=2) == [0, 2]
