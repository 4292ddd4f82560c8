import numpy as np
import pytest

from imop.geometry import se3
from imop.sim.parts.cabinet import CabinetShape, drawer_cabinet
from imop.sim.parts.shapes import add_to
from imop.sim.world import TABLE_HEIGHT, World, scene_spec
from imop.tasks.checks import overlaps

SHAPE = CabinetShape(width=0.3, depth=0.22, drawer_height=0.1, handle_width=0.1)
T_WORLD_CABINET = se3.make(se3.euler(z=np.pi), (0.4, 0, TABLE_HEIGHT))


@pytest.fixture
def world():
    spec = scene_spec()
    add_to(spec, "cabinet", drawer_cabinet(SHAPE, (0.6, 0.4, 0.2), (0.8, 0.6, 0.4), (0.1, 0.1, 0.1)))
    world = World(spec)
    world.set_free_pose("cabinet/body", T_WORLD_CABINET)
    return world


def test_nothing_penetrates_at_any_opening(world):
    for opening in np.linspace(0, SHAPE.travel, 5):
        for drawer in range(3):
            world.set_joint(f"cabinet/drawer{drawer}", opening * (drawer + 1) / 3)
        assert overlaps(world) is None


def test_a_drawer_opens_along_the_cabinets_x_axis_up_to_its_stop(world):
    T_before = world.pose("cabinet/drawer1")
    body = world.model.body("cabinet/drawer1").id
    world.data.xfrc_applied[body, :3] = se3.rotate(T_WORLD_CABINET, np.array([[20.0, 0, 0]]))[0]
    world.step(1000)
    assert world.joint("cabinet/drawer1") == pytest.approx(SHAPE.travel, abs=0.005)
    moved = se3.invert(T_before) @ world.pose("cabinet/drawer1")
    np.testing.assert_allclose(moved[:3, 3], (SHAPE.travel, 0, 0), atol=0.005)
    for other in (0, 2):
        assert abs(world.joint(f"cabinet/drawer{other}")) < 0.003


def test_closed_drawers_stay_closed_by_friction(world):
    world.step(500)
    assert all(abs(world.joint(f"cabinet/drawer{i}")) < 0.001 for i in range(3))


def test_the_frame_of_a_drawer_is_its_handle(world):
    for i in range(3):
        p = (se3.invert(T_WORLD_CABINET) @ world.pose(f"cabinet/drawer{i}"))[:3, 3]
        assert p[2] == pytest.approx(SHAPE.handle_height(i))
        assert SHAPE.depth / 2 < p[0] < SHAPE.depth / 2 + 0.05
