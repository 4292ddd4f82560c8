"""Table tasks with things of another size: the expert goes on, and only a done task is a success."""

import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.sim.world import World
from imop.tasks.changes import Change, factors_of
from imop.tasks.env import make_task
from imop.tasks.expert import perform
from imop.tasks.suites import SUITES, find_task
from imop.tasks.task import Task, make_scene

SEED = 3


def extent(world: World, body: str):
    """Sizes of the box around a body's geometries, in its own axes, as far as their bounding balls reach."""
    m = world.model
    geoms = np.flatnonzero(m.geom_bodyid == m.body(body).id)
    low = (m.geom_pos[geoms] - m.geom_rbound[geoms, None]).min(axis=0)
    return (m.geom_pos[geoms] + m.geom_rbound[geoms, None]).max(axis=0) - low


@pytest.mark.parametrize(
    ("name", "scale"), [("open_drawer", 1.15), ("stack_cubes", 1.15), ("press_buttons", 0.85)]
)
def test_the_expert_does_the_task_with_things_of_another_size(name, scale):
    plain, task = make_task(f"tabletop/{name}"), make_task(f"tabletop/{name}").resized(scale)
    world, usual = make_scene(task, 0, 0, SEED), make_scene(plain, 0, 0, SEED)
    assert len(task.waypoints(world)) == len(plain.waypoints(usual))
    for body in {w.frame for w in task.waypoints(world)}:
        assert extent(world, body) == pytest.approx(scale * extent(usual, body))
    assert not task.success(world)
    perform(task, world)
    assert task.success(world)


def test_sizes_are_drawn_from_the_seed_within_those_of_the_task():
    class Remembers(Task):
        name, sizes = "own/remembers", (0.5, 0.75)
        instructions = build = reset = waypoints = success = None

        def resized(self, scale):
            return scale

    drawn = [Change.of("object_size", "own/remembers", 0, 0, seed).of_size(Remembers()) for seed in range(50)]
    assert min(drawn) >= 0.5 and max(drawn) <= 0.75 and np.std(drawn) > 0.05
    assert drawn[3] == Change.of("object_size", "own/remembers", 0, 0, 3).of_size(Remembers())


def test_a_task_without_sizes_does_not_have_the_factor():
    rope = find_task("tabletop/straighten_rope")
    assert "object_size" not in factors_of(rope)
    assert "object_size" in factors_of(find_task("tabletop/lid_off_pot"))
    unchanged = rope()
    assert Change.of("object_size", "tabletop/straighten_rope", 0, 0, 0).of_size(unchanged) is unchanged


def test_a_task_that_cannot_be_resized_says_so():
    class Plain(Task):
        instructions = build = reset = waypoints = success = None

    with pytest.raises(InvalidInput, match="sizes"):
        Plain().resized(2.0)


def test_ranges_of_sizes_hold_the_usual_size_or_end_there():
    for name, kind in {**SUITES["tabletop"]["all"], **SUITES["rlbench"]["all"]}.items():
        if kind.sizes is not None:
            low, high = kind.sizes
            assert 0.5 <= low <= 1.0 <= high <= 1.5 and low < high, name
