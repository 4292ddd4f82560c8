"""The tasks after the paper's experiment with a real robot."""

import functools

import numpy as np
import pytest

from imop.geometry import se3
from imop.sim.cameras import look_at
from imop.sim.world import scene_spec
from imop.tasks.env import make_task
from imop.tasks.expert import perform, record_demonstration
from imop.tasks.suites import SUITES
from imop.tasks.tabletop import BASE, NOVEL, REAL
from imop.tasks.task import make_scene

SEED = 3

every_task = pytest.mark.parametrize("name", REAL)


@functools.cache
def made(name):
    task = make_task(name)
    world = make_scene(task, 0, SEED, SEED)
    return task, world, world.save_state()


def scene(name):
    task, world, untouched = made(name)
    world.restore_state(untouched)
    return task, world


def things(name, instance):
    task, spec = make_task(name), scene_spec()
    task.build(spec, 0, np.random.default_rng((instance, 0)))
    return spec.compile()


def put(world, frame, *places):
    """Bodies at points of the frame of another one, turned as it is."""
    for body, p in places:
        world.set_free_pose(body, world.pose(frame) @ se3.make(p=p))


def test_they_are_a_split_of_their_own():
    assert SUITES["tabletop"]["real"] == REAL and not REAL.keys() & {*BASE, *NOVEL}
    assert REAL.keys() <= SUITES["tabletop"]["all"].keys()


@every_task
def test_the_expert_reaches_an_aim_that_was_not_reached_before(name):
    task, world = scene(name)
    assert not task.success(world)
    count = len(task.waypoints(world))
    assert len(perform(task, world)) == count and task.success(world)


@every_task
def test_instances_differ_in_sizes_and_colours_and_are_made_again(name):
    first, again, other = (things(name, instance) for instance in (0, 0, 1))
    assert np.array_equal(first.geom_size, again.geom_size)
    assert np.array_equal(first.geom_rgba, again.geom_rgba)
    same = first.ngeom == other.ngeom
    assert not same or not np.allclose(first.geom_size, other.geom_size)
    assert not same or not np.allclose(first.geom_rgba, other.geom_rgba)


@every_task
def test_a_scene_is_that_of_its_seeds(name):
    _, world = scene(name)
    again = make_scene(make_task(name), 0, SEED, SEED)
    assert np.array_equal(world.data.qpos, again.data.qpos)
    assert np.array_equal(world.model.body_pos, again.model.body_pos)


def test_all_toys_have_to_be_in_the_bowl():
    task, world = scene("tabletop/toys_in_bowl")
    put(world, "bowl/body", ("toy0/body", (0.02, 0, -0.01)))
    assert not task.success(world)
    put(world, "bowl/body", ("toy1/body", (-0.02, 0, 0.0)))
    assert task.success(world)
    put(world, "bowl/body", ("toy1/body", (task.radius + 0.02, 0, 0.0)))
    assert not task.success(world)


def test_a_tower_stands_on_the_large_block_in_either_order():
    task, world = scene("tabletop/stack_blocks")
    large, middle, small = (f"{name}/body" for name in ("large", "middle", "small"))
    _, m, s = task.heights
    put(world, large, (middle, (0, 0, m)), (small, (0, 0, m + s)))
    assert task.success(world)
    put(world, large, (small, (0.01, 0, s)), (middle, (0, 0, m + s)))
    assert task.success(world)
    put(world, large, (small, (0.03, 0, s)))
    assert not task.success(world)


def test_an_item_is_in_the_shelf_only_between_its_boards():
    task, world = scene("tabletop/item_in_shelf")
    put(world, "shelf/body", ("item/body", (-0.1, 0, task.kind.height)))
    assert task.success(world)
    for elsewhere in ((-0.1, 0, task.height + 0.02 + task.kind.height), (0.08, 0, task.kind.height)):
        put(world, "shelf/body", ("item/body", elsewhere))
        assert not task.success(world)


def test_one_ball_may_be_spilt_but_not_two():
    task, world = scene("tabletop/pour_cup")
    put(world, "bowl/body", *((f"ball{i}/body", (0.02 * (i - 1.5), 0, -0.04)) for i in range(4)))
    assert task.success(world)
    put(world, "bowl/body", ("ball0/body", (0.3, 0, 0)))
    assert not task.success(world)


def test_a_tight_cap_cannot_be_pulled_off():
    task, world = scene("tabletop/open_bottle")
    weight = world.model.body("cap/body").mass[0] * 9.81
    world.data.body("cap/body").xfrc_applied[2] = 5 + weight
    world.step(200)
    T = se3.invert(world.pose("bottle/body")) @ world.pose("cap/body")
    assert T[2, 3] < 0.01 and not task.success(world)
    put(world, "bottle/body", ("cap/body", (0.1, 0, -0.1)))
    assert task.success(world)


def test_a_demonstration_is_seen_by_the_cameras_that_there_are():
    cameras = {"beside": look_at((0.2, 1.0, 1.5), (0.2, 0, 0.8), 40.0, (32, 24))}
    shown = record_demonstration(make_task("tabletop/lid_off_pot"), SEED, cameras=cameras)
    for observation in (*(k.observation for k in shown.keyframes), shown.final):
        assert list(observation.views) == ["beside"]
        assert observation.views["beside"].depth.shape == (24, 32)
