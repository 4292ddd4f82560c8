import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.geometry.neighbours import nearest, within


def test_against_brute_force(rng):
    query, points = rng.normal(size=(20, 3)), rng.normal(size=(50, 3))
    distances = np.linalg.norm(query[:, None] - points[None], axis=-1)
    found, indices = nearest(query, points, k=4)
    np.testing.assert_allclose(found, np.sort(distances, axis=1)[:, :4])
    np.testing.assert_array_equal(indices, np.argsort(distances, axis=1)[:, :4])
    np.testing.assert_array_equal(within(query, points, 0.5), distances.min(axis=1) < 0.5)


def test_one_neighbour_keeps_its_axis(rng):
    assert nearest(rng.normal(size=(5, 3)), rng.normal(size=(9, 3)))[0].shape == (5, 1)


def test_no_points():
    assert not within(np.zeros((3, 3)), np.zeros((0, 3)), 1.0).any()
    with pytest.raises(InvalidInput, match="k"):
        nearest(np.zeros((3, 3)), np.zeros((0, 3)))
