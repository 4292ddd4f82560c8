import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from imop.geometry import se3
from imop.tasks.coppelia.boxes import corners
from imop.tasks.layout import NoRoom
from imop.tasks.rlbench.spawn import WORKSPACE, Area, Boundary, area, draw, touch

LOWER, UPPER = np.array([-0.3, -0.4]), np.array([0.3, 0.4])
side = st.floats(0.0, 0.5)
seeds = st.integers(0, 10_000)


def box(x0, x1, y0, y1):
    return np.array([-x0, -y0, -0.1]), np.array([x1, y1, 0.1])


@given(side, side, side, side, seeds)
def test_what_is_drawn_lies_inside_with_its_turned_box(x0, x1, y0, y1, seed):
    drawn = draw(np.random.default_rng(seed), box(x0, x1, y0, y1), LOWER, UPPER, (-3.14, 3.14))
    if drawn is not None:
        *place, yaw = drawn
        turned = corners(box(x0, x1, y0, y1))[:, :2] @ se3.euler(z=yaw)[:2, :2]
        assert np.all(place + turned >= LOWER - 1e-9)
        assert np.all(place + turned <= UPPER + 1e-9)


@given(st.floats(0.301, 1.0), seeds)
def test_a_side_longer_than_half_the_rectangle_never_fits_unturned(far, seed):
    assert draw(np.random.default_rng(seed), box(0.0, far, 0.1, 0.1), LOWER, UPPER, (0.0, 0.0)) is None


@given(seeds)
def test_the_yaw_keeps_its_bounds(seed):
    drawn = draw(np.random.default_rng(seed), box(0.1, 0.1, 0.1, 0.1), LOWER, UPPER, (0.2, 0.5))
    assert drawn is not None and 0.2 <= drawn[2] <= 0.5


def test_open_drawer_keeps_five_degrees_of_its_yaw_as_in_the_recordings():
    rng = np.random.default_rng(0)
    cabinet = box(0.191, 0.191, 0.189, 0.440)
    bounds = (WORKSPACE.lower, WORKSPACE.upper, (-np.pi / 8, np.pi / 8))
    yaws = [drawn[2] for _ in range(2000) if (drawn := draw(rng, cabinet, *bounds)) is not None]
    assert np.degrees(max(yaws)) == pytest.approx(5.0, abs=0.3)
    assert np.degrees(min(yaws)) == pytest.approx(-5.0, abs=0.3)


def test_the_area_of_a_plane_is_the_plane(scene):
    found = area(scene, "area")
    assert found.lower == pytest.approx([-0.2, -0.2])
    assert found.upper == pytest.approx([0.2, 0.2])
    assert found.T_world_area == pytest.approx(scene.pose("area"))


@pytest.mark.parametrize("seed", range(5))
def test_samples_stay_in_their_area_and_at_their_height(scene, seed):
    room = Area(se3.make(se3.euler(z=0.4), (0.1, 0.2, 0.75)), LOWER, UPPER)
    height = scene.pose("ball")[2, 3]
    Boundary(scene, np.random.default_rng(seed), [room]).sample("ball")
    T = se3.invert(room.T_world_area) @ scene.pose("ball")
    assert np.all((T[:2, 3] >= LOWER) & (T[:2, 3] <= UPPER))
    assert scene.pose("ball")[2, 3] == pytest.approx(height)


def test_things_that_are_sampled_together_do_not_touch(scene):
    room = Boundary(scene, np.random.default_rng(1), [Area(scene.pose("area"), LOWER, UPPER)])
    for name in ("drawer", "ball"):
        room.sample(name)
    assert not touch(scene, "drawer", "ball")


def test_where_nothing_fits_there_is_no_room(scene):
    tiny = Area(scene.pose("area"), np.full(2, -0.01), np.full(2, 0.01))
    with pytest.raises(NoRoom, match="ball"):
        Boundary(scene, np.random.default_rng(0), [tiny]).sample("ball")
