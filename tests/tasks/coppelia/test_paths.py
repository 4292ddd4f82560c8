import numpy as np
import pytest

from imop.geometry import se3
from imop.tasks.coppelia.paths import ControlPoint, polyline


def corners(*points, share=1.0, n=1):
    return [ControlPoint(se3.make(p=p), share, share, n) for p in points]


RIGHT_ANGLE = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0))


def test_without_arcs_the_curve_is_its_corners():
    assert polyline(corners(*RIGHT_ANGLE), False)[:, :3, 3] == pytest.approx(np.array(RIGHT_ANGLE))
    assert polyline([], False).shape == (0, 4, 4)


def test_an_arc_runs_between_the_sides_and_touches_them():
    points = polyline(corners(*RIGHT_ANGLE, n=21), False)[:, :3, 3]
    assert points[0] == pytest.approx([0, 0, 0])
    assert points[1] == pytest.approx([0.5, 0, 0]) and points[-2] == pytest.approx([1, 0.5, 0])
    assert points[11] == pytest.approx([0.875, 0.125, 0])  # the middle of a parabola
    first, last = points[2] - points[1], points[-2] - points[-3]
    assert abs(first[1]) < 0.1 * first[0] and abs(last[0]) < 0.1 * last[1]


def test_smaller_shares_cut_less():
    corner = np.array([1.0, 0, 0])

    def distance(share):
        points = polyline(corners(*RIGHT_ANGLE, share=share, n=9), False)[:, :3, 3]
        return np.linalg.norm(points - corner, axis=1).min()

    assert distance(0.2) < distance(0.6) < distance(1.0)


def test_straight_corners_stay_and_closed_curves_cut_all():
    straight = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.0))
    assert len(polyline(corners(*straight, n=9), False)) == 3
    assert len(polyline(corners(*RIGHT_ANGLE, n=9), True)) == 27


def test_orientations_turn_along():
    a, b = se3.make(p=(0.0, 0, 0)), se3.make(se3.euler(z=1.0), (1.0, 1.0, 0))
    middle = ControlPoint(se3.make(se3.euler(z=0.5), (1.0, 0, 0)), 1.0, 1.0, 11)
    points = polyline([ControlPoint(a, 0, 0, 1), middle, ControlPoint(b, 0, 0, 1)], False)
    angles = np.arctan2(points[:, 1, 0], points[:, 0, 0])
    assert np.all(np.diff(angles) > 0)
    assert angles[6] == pytest.approx(0.5)
