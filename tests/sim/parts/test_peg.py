import numpy as np
import pytest

from imop.geometry import se3
from imop.sim.parts.peg import PLATE, RingShape, peg, ring
from imop.sim.parts.shapes import add_to
from imop.sim.world import TABLE_HEIGHT, World, scene_spec
from imop.tasks.checks import overlaps

SHAPE = RingShape(hole=0.02, width=0.012, height=0.015, peg_radius=0.014, peg_height=0.08)
T_PEG = se3.make(se3.euler(z=0.5), (0.3, 0, TABLE_HEIGHT))
RED = (1.0, 0.0, 0.0)


@pytest.fixture
def world():
    spec = scene_spec()
    add_to(spec, "ring", ring(SHAPE, RED, RED))
    add_to(spec, "peg", peg(SHAPE, RED, RED))
    world = World(spec)
    world.set_free_pose("peg/body", T_PEG)
    return world


def test_a_ring_lies_flat_on_the_table(world):
    T = se3.make(p=(0.3, 0.3, TABLE_HEIGHT))
    world.set_free_pose("ring/body", T)
    assert 0.005 < world.model.body("ring/body").mass[0] < 0.1
    world.step(500)
    assert se3.translation_distance(T, world.pose("ring/body")) < 0.002
    assert se3.rotation_distance(T, world.pose("ring/body")) < 0.02
    assert overlaps(world) is None


@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_let_go_over_the_peg_a_ring_slides_down_to_the_plate_and_cannot_leave_sideways(world, yaw):
    T_down = T_PEG @ se3.make(se3.euler(z=yaw), (0, 0, PLATE))
    world.set_free_pose("ring/body", se3.make(p=(0, 0, 0.02)) @ T_down)
    assert overlaps(world) is None
    world.step(500)
    assert se3.translation_distance(T_down, world.pose("ring/body")) < 0.008
    world.data.qvel[world.model.joint("ring/free").dofadr[0]] = 0.5
    world.step(500)
    beside = (se3.invert(T_PEG) @ world.pose("ring/body"))[:2, 3]
    assert np.hypot(*beside) < SHAPE.hole - SHAPE.peg_radius + 0.002
