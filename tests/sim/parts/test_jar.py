import numpy as np
import pytest

from imop.geometry import se3
from imop.sim.parts.jar import DROP, LID_HEIGHT, TOP, TURN, JarShape, jar, screw_lid
from imop.sim.parts.shapes import add_to
from imop.sim.world import TABLE_HEIGHT, World, scene_spec
from imop.tasks.checks import overlaps

SHAPE = JarShape(neck=0.022, radius=0.036, height=0.09)
T_JAR = se3.make(se3.euler(z=0.4), (0.3, 0, TABLE_HEIGHT + SHAPE.height))
RED = (1.0, 0.0, 0.0)


@pytest.fixture
def world():
    spec = scene_spec()
    add_to(spec, "jar", jar(SHAPE, RED, RED, RED))
    add_to(spec, "lid", screw_lid(SHAPE, RED, RED))
    world = World(spec)
    world.set_free_pose("jar/body", T_JAR)
    return world


def put_on(world, turn):
    T = T_JAR @ se3.make(se3.euler(z=-turn), (0, 0, TOP + DROP * (1 - turn / TURN) + 0.0003))
    world.set_free_pose("lid/body", T)


def push(world, force, steps=500):
    """Force and torque (6,) on the lid, world frame."""
    body = world.model.body("lid/body").id
    world.data.xfrc_applied[body] = force
    world.step(steps)
    world.data.xfrc_applied[body] = 0
    return se3.invert(T_JAR) @ world.pose("lid/body")


def test_a_lid_lies_on_the_table(world):
    T = se3.make(p=(0.3, 0.3, TABLE_HEIGHT + LID_HEIGHT))
    world.set_free_pose("lid/body", T)
    assert 0.005 < world.model.body("lid/body").mass[0] < 0.1
    world.step(500)
    assert se3.translation_distance(T, world.pose("lid/body")) < 0.002
    assert overlaps(world) is None


@pytest.mark.parametrize("fraction", np.linspace(0, 1, 7))
def test_the_thread_touches_nothing_along_the_whole_turn(world, fraction):
    put_on(world, fraction * TURN)
    lid = world.model.body("lid/body").id
    bodies = world.model.geom_bodyid[world.data.contact.geom]
    assert not np.any(bodies == lid)


def test_a_lid_that_was_only_set_on_stays_too_high_and_comes_off(world):
    put_on(world, 0.0)
    resting = push(world, (0, 0, 0, 0, 0, 0))
    assert resting[2, 3] > TOP + 0.5 * DROP
    lifted = push(world, (0, 0, 2, 0, 0, 0), steps=150)
    assert lifted[2, 3] > TOP + 0.02


def test_a_clockwise_torque_screws_the_lid_down_and_then_it_holds(world):
    put_on(world, 0.0)
    T = push(world, (0, 0, -1, 0, 0, -0.03))
    assert T[2, 3] == pytest.approx(TOP, abs=0.0008)
    turned = -np.arctan2(T[1, 0], T[0, 0])
    assert np.radians(75) < turned < np.radians(105)
    pulled = push(world, (0, 0, 5, 0, 0, 0))
    assert pulled[2, 3] < TOP + DROP
