import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from imop.errors import ImopError
from imop.geometry import se3
from imop.sim.parts.shapes import add_to
from imop.sim.parts.solids import block
from imop.sim.world import TABLE_HEIGHT, World, scene_spec
from imop.tasks.layout import ROBOT_FOOT, Area, Item, NoRoom, scatter

COUNT = 5


@pytest.fixture(scope="module")
def world():
    spec = scene_spec()
    for i in range(COUNT):
        add_to(spec, f"cube{i}", block((0.04, 0.04, 0.04), (1, 0, 0)))
    return World(spec)


@given(seed=st.integers(0, 2**32 - 1), radius=st.floats(0.03, 0.07))
def test_footprints_are_apart_and_origins_within_the_area(world, seed, radius):
    items = [Item(f"cube{i}/body", ((0, 0, radius), (0.02, 0, radius)), 0.04) for i in range(COUNT)]
    taken = scatter(world, np.random.default_rng(seed), items, np.array([ROBOT_FOOT]))
    assert len(taken) == 1 + 2 * COUNT
    owner = np.array([-1, *np.repeat(np.arange(COUNT), 2)])
    gaps = (
        np.linalg.norm(taken[:, None, :2] - taken[None, :, :2], axis=2)
        - taken[:, None, 2]
        - taken[None, :, 2]
    )
    assert gaps[owner[:, None] != owner[None]].min() > 0
    for item in items:
        x, y, z = world.pose(item.body)[:3, 3]
        assert item.area.x[0] <= x <= item.area.x[1] and item.area.y[0] <= y <= item.area.y[1]
        assert z == pytest.approx(TABLE_HEIGHT + 0.04)


def test_circles_turn_with_the_body():
    item = Item("a", ((0.1, 0.0, 0.02),))
    circles = item.circles(se3.make(se3.euler(z=np.pi / 2), (1.0, 2.0, 0.75)))
    np.testing.assert_allclose(circles, [(1.0, 2.1, 0.02)], atol=1e-12)


def test_a_full_table_is_an_error_not_a_hang(world):
    items = [Item(f"cube{i}/body", ((0, 0, 0.2),), area=Area((0.2, 0.3), (0, 0.1))) for i in range(2)]
    with pytest.raises(NoRoom, match="cube1/body"):
        scatter(world, np.random.default_rng(0), items, np.array([ROBOT_FOOT]))
    assert issubclass(NoRoom, ImopError)
