import numpy as np
import pytest

from imop.geometry import se3
from imop.sim.parts.faucet import SIDES, WIDEST, FaucetShape, direction, faucet
from imop.sim.parts.shapes import add_to
from imop.sim.world import TABLE_HEIGHT, World, scene_spec
from imop.tasks.checks import overlaps

SHAPE = FaucetShape(spread=0.1, height=0.1, lever=0.08, radius=0.008, spout=0.12)
T_WORLD_FAUCET = se3.make(se3.euler(z=1.0), (0.3, 0, TABLE_HEIGHT))


@pytest.fixture
def world():
    spec = scene_spec()
    add_to(spec, "faucet", faucet(SHAPE, (0.7, 0.7, 0.7), (0.2, 0.2, 0.2)))
    world = World(spec)
    world.set_free_pose("faucet/body", T_WORLD_FAUCET)
    return world


@pytest.mark.parametrize("side", SIDES)
def test_levers_point_outwards_and_turn_to_the_front(world, side):
    def lever():
        return se3.rotate(se3.invert(T_WORLD_FAUCET) @ world.pose(f"faucet/{side}"), np.array([[1.0, 0, 0]]))[
            0
        ]

    np.testing.assert_allclose(lever(), (0, direction(side), 0), atol=1e-6)
    world.set_joint(f"faucet/{side}", np.pi / 2)
    np.testing.assert_allclose(lever(), (1, 0, 0), atol=1e-6)


def test_nothing_penetrates_at_any_angle(world):
    for angle in np.linspace(0, WIDEST, 5):
        for side in SIDES:
            world.set_joint(f"faucet/{side}", angle)
        assert overlaps(world) is None


@pytest.mark.parametrize("side", SIDES)
def test_a_lever_needs_a_little_torque_and_stops_at_its_widest(world, side):
    dof = world.model.joint(f"faucet/{side}").dofadr[0]
    world.data.qfrc_applied[dof] = 0.05
    world.step(500)
    assert abs(world.joint(f"faucet/{side}")) < 0.02
    world.data.qfrc_applied[dof] = 0.3
    world.step(1000)
    assert world.joint(f"faucet/{side}") == pytest.approx(WIDEST, abs=0.05)
