import numpy as np
import pytest

from imop.geometry import se3
from imop.sim.parts.hinged_box import WIDEST, BoxShape, hinged_box
from imop.sim.parts.shapes import add_to
from imop.sim.world import TABLE_HEIGHT, World, scene_spec
from imop.tasks.checks import overlaps

SHAPE = BoxShape(depth=0.16, width=0.22, height=0.13)
COLOR = (0.5, 0.5, 0.5)
T_WORLD_BOX = se3.make(se3.euler(z=2.0), (0.3, 0, TABLE_HEIGHT))


@pytest.fixture
def world():
    spec = scene_spec()
    add_to(spec, "box", hinged_box(SHAPE, COLOR, COLOR, COLOR))
    world = World(spec)
    world.set_free_pose("box/body", T_WORLD_BOX)
    return world


def test_the_frame_of_the_lid_moves_as_the_shape_says(world):
    for angle in np.linspace(0, WIDEST, 5):
        world.set_joint("box/lid", angle)
        assert overlaps(world) is None
        np.testing.assert_allclose(world.pose("box/lid"), T_WORLD_BOX @ SHAPE.tab(angle), atol=1e-6)


def test_the_lid_falls_shut_before_the_upright_and_stays_open_beyond(world):
    world.set_joint("box/lid", np.radians(70))
    world.step(1500)
    assert world.joint("box/lid") == pytest.approx(0.0, abs=0.02)
    world.set_joint("box/lid", np.radians(105))
    world.step(1500)
    assert np.radians(104) < world.joint("box/lid") < WIDEST + 0.05


def test_a_hand_can_lift_the_lid(world):
    assert 0.1 < world.model.body("box/lid").mass[0] < 0.5
