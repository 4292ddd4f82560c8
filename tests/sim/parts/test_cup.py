import numpy as np
import pytest

from imop.geometry import se3
from imop.sim.parts.cup import CupShape, along_rod, cup, hook_stand
from imop.sim.parts.shapes import add_to
from imop.sim.world import TABLE_HEIGHT, World, scene_spec
from imop.tasks.checks import overlaps

SHAPE = CupShape(radius=0.04, height=0.085, taper=0.85, reach=0.03)
T_STAND = se3.make(se3.euler(z=1.0), (0.3, 0, TABLE_HEIGHT))
RED = (1.0, 0.0, 0.0)


@pytest.fixture
def world():
    spec = scene_spec()
    add_to(spec, "stand", hook_stand(0.2, RED, RED))
    add_to(spec, "cup", cup(SHAPE, RED))
    world = World(spec)
    world.set_free_pose("stand/body", T_STAND)
    return world


def hang(world):
    """Put the cup, tilted, with its handle around the rod, without contact."""
    x_low, x_high, z_low, z_high = SHAPE.loop
    middle = np.array([0.4 * x_low + 0.6 * x_high, 0, 0.4 * z_low + 0.6 * z_high])
    R = se3.euler(z=-np.pi / 2, y=0) @ se3.euler(y=np.radians(-40))
    world.set_free_pose("cup/body", world.pose("stand/hook") @ se3.make(R, -R @ middle))


def test_a_cup_stands_on_the_table(world):
    T = se3.make(p=(0.3, 0.3, TABLE_HEIGHT + SHAPE.height))
    world.set_free_pose("cup/body", T)
    assert 0.02 < world.model.body("cup/body").mass[0] < 0.3
    world.step(500)
    assert se3.translation_distance(T, world.pose("cup/body")) < 0.002
    assert se3.rotation_distance(T, world.pose("cup/body")) < 0.02
    assert overlaps(world) is None


def test_a_cup_hung_by_its_handle_comes_to_rest_there(world):
    hang(world)
    assert overlaps(world) is None
    world.step(1500)
    settled = world.pose("cup/body")
    assert settled[2, 3] > TABLE_HEIGHT + 0.1
    world.step(500)
    assert se3.translation_distance(settled, world.pose("cup/body")) < 0.005
    handle = se3.apply(settled, np.array([[SHAPE.radius + SHAPE.reach, 0, -SHAPE.height / 2]]))[0]
    assert np.linalg.norm(handle - world.pose("stand/hook")[:3, 3]) < 0.08


def test_the_rod_rises_outwards(world):
    near, far = se3.apply(world.pose("stand/hook"), np.stack([along_rod(0), along_rod(0.04)]))
    assert far[2] > near[2] + 0.005
