"""What is meant: named by masks, points or a box."""

import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.geometry.cloud import PointCloud
from imop.geometry.focus import Focus, in_focus
from imop.types import Observation
from tests.policy.scenes import BLUE, RED, above, box, camera

LEFT, RIGHT = np.array([-0.2, 0.0, 0.0]), np.array([0.2, 0.0, 0.0])
# A camera 2 m above sees the tops of both at this depth.
TOP = 0.06
SEEN = Observation({"top": camera(np.full((64, 64), 2.0 - TOP, np.float32))}, above(0, 0, 1.0), 1.0)


def two():
    parts = [box((0.1, 0.1, TOP), color) for color in (RED, BLUE)]
    points = np.concatenate([part.points + at for part, at in zip(parts, (LEFT, RIGHT), strict=True)])
    colors = np.concatenate([part.colors for part in parts])
    return PointCloud(points, colors, np.zeros(len(points), dtype=np.int32))


def test_a_box_and_points_on_a_thing_name_it():
    cloud = two()
    left = cloud.points[:, 0] < 0
    box_of_left = Focus(box=np.stack([LEFT - 0.1, LEFT + 0.1]))
    np.testing.assert_array_equal(in_focus(box_of_left, SEEN, cloud), left)
    np.testing.assert_array_equal(in_focus(Focus(points=cloud.points[left]), SEEN, cloud), left)


def test_a_mask_names_what_its_pixels_see_and_nothing_below():
    cloud = two()
    mask = np.zeros((64, 64), dtype=bool)
    mask[:, :32] = True
    meant = in_focus(Focus(masks={"top": mask}), SEEN, cloud)
    assert meant.any() and (cloud.points[meant, 0] < 0).all()
    assert cloud.points[meant, 2].min() > TOP - 0.016
    full = in_focus(Focus(masks={"top": ~mask | mask}), SEEN, cloud)
    assert (full & (cloud.points[:, 0] > 0)).any()


def test_what_any_of_them_names_is_meant():
    cloud = two()
    both = Focus(points=cloud.points[:1], box=np.stack([RIGHT - 0.1, RIGHT + 0.1]))
    meant = in_focus(both, SEEN, cloud)
    assert meant[0] and meant[cloud.points[:, 0] > 0].all()


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: Focus(), "focus"),
        (lambda: Focus(box=np.array([[1.0, 0, 0], [0.0, 1, 1]])), "box"),
        (lambda: Focus(points=np.zeros((3, 2))), "points"),
        (lambda: in_focus(Focus(masks={"wrist": np.ones((64, 64), bool)}), SEEN, two()), "focus.masks"),
        (lambda: in_focus(Focus(masks={"top": np.ones((2, 2), bool)}), SEEN, two()), "focus.masks"),
    ],
)
def test_what_says_nothing_or_does_not_fit_is_refused(make, field):
    with pytest.raises(InvalidInput) as error:
        make()
    assert error.value.field == field
