import numpy as np
import pytest

from imop.cameras.interfaces import Frame
from imop.errors import InvalidInput
from imop.geometry import se3

K = np.array([[50.0, 0, 3.5], [0, 50.0, 2.5], [0, 0, 1]])


def frame(**changes):
    good = {"rgb": np.full((6, 8, 3), 7, np.uint8), "depth": np.ones((6, 8)), "intrinsics": K, "stamp": 1.5}
    return Frame(**{**good, **changes})


def test_a_frame_seen_from_somewhere_is_the_view_of_the_same_pixels():
    T = se3.make(se3.euler(x=3.0), (0.1, 0.2, 1.0))
    view = frame().seen_from(T)
    np.testing.assert_array_equal(view.rgb, frame().rgb)
    np.testing.assert_array_equal(view.depth, frame().depth)
    np.testing.assert_array_equal(view.intrinsics, K)
    np.testing.assert_array_equal(view.T_world_camera, T)
    assert frame().depth.dtype == np.float32


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("rgb", np.zeros((6, 8, 4), np.uint8)),
        ("rgb", np.ones((6, 8, 3))),
        ("depth", np.ones((5, 8))),
        ("intrinsics", K.T),
        ("intrinsics", -K),
        ("stamp", np.inf),
    ],
)
def test_what_no_camera_delivers_is_refused_by_name(field, value):
    with pytest.raises(InvalidInput, match=field):
        frame(**{field: value})
