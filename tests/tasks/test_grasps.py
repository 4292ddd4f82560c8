import numpy as np

from imop.tasks.grasps import backed_off, from_above, from_front, shifted


def test_from_above_points_down_and_closes_along_y():
    T = from_above((0, 0, 0.1))
    np.testing.assert_allclose(T[:3, 2], (0, 0, -1), atol=1e-12)
    np.testing.assert_allclose(np.abs(T[:3, 1]), (0, 1, 0), atol=1e-12)
    assert np.linalg.det(T[:3, :3]) > 0


def test_from_front_points_into_the_frame_and_closes_across_a_bar_along_y():
    T = from_front(pitch=0.2)
    np.testing.assert_allclose(T[:3, 2], (-np.cos(0.2), 0, -np.sin(0.2)), atol=1e-12)
    assert abs(T[1, 1]) < 1e-12
    assert np.linalg.det(T[:3, :3]) > 0


def test_backed_off_goes_against_the_approach_and_shifted_along_the_frame():
    np.testing.assert_allclose(backed_off(from_above(), 0.1)[:3, 3], (0, 0, 0.1), atol=1e-12)
    np.testing.assert_allclose(shifted(from_front(), (0.2, 0, 0))[:3, 3], (0.2, 0, 0), atol=1e-12)
