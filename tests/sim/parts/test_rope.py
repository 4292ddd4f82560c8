import numpy as np
import pytest

from imop.geometry import se3
from imop.sim.gripper import set_gripper
from imop.sim.parts.rope import RopeShape, bend, outline, rope
from imop.sim.parts.shapes import add_to
from imop.sim.world import TABLE_HEIGHT, World, allow_grasp, scene_spec
from imop.tasks.checks import overlaps

SHAPE = RopeShape(links=14, pitch=0.024, radius=0.008)
ANGLES = 0.4 * np.sin(np.linspace(0, 6, SHAPE.links - 1))
T_WORLD_ROPE = se3.make(p=(0.1, 0, TABLE_HEIGHT + SHAPE.radius))


@pytest.fixture
def world():
    spec = scene_spec()
    add_to(spec, "rope", rope(SHAPE, (0.9, 0.9, 0.7), ((1, 0, 0), (0, 0, 1))))
    allow_grasp(spec, "rope/body")
    world = World(spec)
    world.set_free_pose("rope/body", T_WORLD_ROPE)
    return world


def middles(world):
    names = ["rope/body", *(f"rope/link{i}" for i in range(1, SHAPE.links - 1)), "rope/end"]
    return np.stack([world.pose(name)[:3, 3] for name in names])


def test_the_straight_rope_has_its_length(world):
    p = middles(world)
    assert np.linalg.norm(p[-1] - p[0]) == pytest.approx(SHAPE.length)


def test_bending_lays_the_rope_out_as_its_outline_says(world):
    bend(world, "rope", SHAPE, ANGLES)
    np.testing.assert_allclose(middles(world)[:, :2] - T_WORLD_ROPE[:2, 3], outline(SHAPE, ANGLES), atol=1e-6)
    assert overlaps(world) is None


def test_a_bent_rope_lies_still_on_the_table(world):
    bend(world, "rope", SHAPE, ANGLES)
    before = middles(world)
    world.step(500)
    np.testing.assert_allclose(middles(world), before, atol=0.002)


def test_a_rope_held_at_one_end_hangs_without_tearing(world):
    p_tip = world.T_world_gripper[:3, 3]
    world.set_free_pose("rope/body", se3.make(p=tuple(p_tip - (0, 0, 0.003))))
    set_gripper(world, gripper_open=False)
    assert world.held == ("rope/body",)
    world.step(4000)
    p = middles(world)
    assert np.linalg.norm(p[0] - p_tip) < 0.01
    assert p[0, 2] - p[-1, 2] > 0.7 * SHAPE.length
    assert np.all(np.linalg.norm(np.diff(p, axis=0), axis=1) < 1.01 * SHAPE.pitch)
