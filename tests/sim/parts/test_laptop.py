import numpy as np
import pytest

from imop.geometry import se3
from imop.sim.parts.laptop import WIDEST, LaptopShape, laptop
from imop.sim.parts.shapes import add_to
from imop.sim.world import TABLE_HEIGHT, World, scene_spec
from imop.tasks.checks import overlaps

SHAPE = LaptopShape(width=0.28, depth=0.2, height=0.018)
COLOR = (0.5, 0.5, 0.5)


@pytest.fixture
def world():
    spec = scene_spec()
    add_to(spec, "laptop", laptop(SHAPE, COLOR, COLOR, COLOR))
    world = World(spec)
    world.set_free_pose("laptop/body", se3.make(p=(0.3, 0, TABLE_HEIGHT)))
    return world


def test_the_hinge_holds_the_screen_where_it_is_left(world):
    for angle in np.radians([30, 70, 120]):
        world.set_joint("laptop/screen", angle)
        assert overlaps(world) is None
        world.step(500)
        assert world.joint("laptop/screen") == pytest.approx(angle, abs=0.02)


def test_the_screen_turns_between_its_stops(world):
    hinge = world.model.joint("laptop/screen").dofadr[0]
    for torque, stop in ((2.0, WIDEST), (-2.0, 0.0)):
        world.data.qfrc_applied[hinge] = torque
        world.step(1000)
        assert world.joint("laptop/screen") == pytest.approx(stop, abs=0.05)


def test_the_shut_screen_lies_on_the_base(world):
    top = world.pose("laptop/screen") @ (SHAPE.depth, 0, 0.009, 1)
    assert top[2] - TABLE_HEIGHT == pytest.approx(SHAPE.shut_height)


def test_the_screen_has_the_weight_of_a_laptops_screen(world):
    assert 0.2 < world.model.body("laptop/screen").mass[0] < 0.8
