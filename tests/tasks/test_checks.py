import numpy as np
import pytest

from imop.geometry import se3
from imop.sim.parts.shapes import add_to
from imop.sim.parts.solids import block
from imop.sim.world import TABLE_HEIGHT, World, scene_spec
from imop.tasks.checks import at_rest, overlaps, reachable, rehearse, settle
from imop.tasks.grasps import from_above
from imop.tasks.waypoint import Waypoint

SIZE = 0.05


@pytest.fixture
def world():
    spec = scene_spec()
    for name in ("a", "b"):
        add_to(spec, name, block((SIZE, SIZE, SIZE), (1, 0, 0)))
    world = World(spec)
    put(world, "a", 0.3, 0.0)
    put(world, "b", 0.3, 0.3)
    return world


def put(world, name, x, y, height=SIZE):
    world.set_free_pose(f"{name}/body", se3.make(p=(x, y, TABLE_HEIGHT + height)))


def test_overlap_names_the_pair(world):
    assert overlaps(world) is None
    put(world, "b", 0.3, SIZE - 0.005)
    assert set(overlaps(world)) == {"a/body", "b/body"}


def test_a_falling_block_is_not_at_rest_until_it_settled_and_has_moved_then(world):
    put(world, "a", 0.3, 0.0, SIZE + 0.05)
    before = {"a/body": world.pose("a/body")}
    world.step(20)
    assert not at_rest(world, {})
    settle(world)
    assert at_rest(world, {})
    assert not at_rest(world, before)


def test_reach_ends_at_the_workspace_and_at_obstacles_unless_they_may_be_touched(world):
    def above(x, y, z):
        return se3.make(p=(x, y, TABLE_HEIGHT)) @ from_above((0, 0, z))

    assert reachable(world, above(0.3, 0.15, 0.1), allow_collisions=False)
    assert not reachable(world, above(1.5, 0.0, 0.1), allow_collisions=True)
    inside = above(0.3, 0.04, 0.01)
    assert not reachable(world, inside, allow_collisions=False)
    assert reachable(world, inside, allow_collisions=True)


def test_rehearsal_finds_what_the_hand_would_hit_and_leaves_the_world_alone(world):
    grasp = Waypoint("a/body", from_above((0, 0, -0.02)), gripper_open=False, allow_collisions=True)
    before = world.save_state().physics
    assert rehearse(world, [grasp]) == ""
    put(world, "b", 0.3, 0.06)
    assert "b/body" in rehearse(world, [grasp])
    put(world, "b", 0.3, 0.3)
    far = Waypoint("a/body", from_above((1.0, 0, 0.1)), gripper_open=True)
    assert rehearse(world, [grasp, far]) == "outside_workspace"
    np.testing.assert_array_equal(world.save_state().physics, before)
