import numpy as np
import pytest

from imop.geometry import se3
from imop.sim.parts.button import CAP, HOUSING, OUT_OF_ORDER, PRESSED, STROKE, spring_button, watch_order
from imop.sim.parts.shapes import add_to
from imop.sim.world import TABLE_HEIGHT, World, scene_spec
from imop.tasks.checks import overlaps

RED = (1.0, 0.0, 0.0)


@pytest.fixture
def world():
    spec = scene_spec()
    for name in ("a", "b"):
        add_to(spec, name, spring_button(0.02, RED, RED))
    watch_order(spec, "order", "a", "b")
    world = World(spec)
    for name, y in (("a", -0.1), ("b", 0.1)):
        world.set_free_pose(f"{name}/body", se3.make(p=(0.3, y, TABLE_HEIGHT)))
    return world


def press(world, name, force=10.0):
    """Push the cap down by a force, let it go, and tell how deep it was."""
    body = world.model.body(f"{name}/cap").id
    world.data.xfrc_applied[body, 2] = -force
    world.step(200)
    depth = world.joint(f"{name}/cap")
    world.data.xfrc_applied[body, 2] = 0
    world.step(200)
    return depth


def test_a_cap_stands_up_goes_down_to_its_stop_and_springs_back(world):
    world.step(200)
    top = world.pose("a/cap")[2, 3]
    assert top == pytest.approx(TABLE_HEIGHT + HOUSING + CAP, abs=0.001)
    assert overlaps(world) is None
    assert press(world, "a") == pytest.approx(STROKE, abs=0.001)
    assert world.pose("a/cap")[2, 3] == pytest.approx(top, abs=0.0005)


def test_the_needle_keeps_the_greatest_depth_however_long_it_waits(world):
    assert world.joint("a/pressed") < 0.1 * STROKE
    touched = press(world, "a", force=2.0)
    assert 0.1 * STROKE < touched < 0.6 * PRESSED
    assert world.joint("a/pressed") == pytest.approx(touched, abs=0.001)
    press(world, "a")
    world.step(5_000)
    assert world.joint("a/pressed") > PRESSED
    assert world.joint("b/pressed") < 0.1 * STROKE


@pytest.mark.parametrize(("order", "wrong"), [("ab", False), ("aab", False), ("ba", True), ("bab", True)])
def test_the_order_is_remembered(world, order, wrong):
    for name in order:
        press(world, name)
    assert (world.joint("order") > OUT_OF_ORDER) == wrong
    assert all(world.joint(f"{name}/pressed") > PRESSED for name in "ab")


def test_a_restored_state_has_forgotten_what_came_later(world):
    before = world.save_state()
    press(world, "b")
    world.restore_state(before)
    assert world.joint("b/pressed") < 0.1 * STROKE
    press(world, "a")
    press(world, "b")
    assert world.joint("order") < OUT_OF_ORDER


def test_needles_are_invisible_and_touch_nothing(world):
    names = [world.model.body(b).name for b in world.model.geom_bodyid]
    assert not any("pressed" in name or "order" in name for name in names)
    assert np.isfinite(world.data.qacc).all()
