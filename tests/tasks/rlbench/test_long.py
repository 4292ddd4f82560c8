"""Long tasks: scenes of the tasks that they are made of, always with the most things."""

import numpy as np
import pytest

from imop.tasks.env import make_task
from imop.tasks.rlbench import LONG, RLBENCH
from imop.tasks.rlbench.task import RLBenchTask
from imop.tasks.suites import SUITES
from imop.tasks.task import make_scene
from tests.tasks.rlbench.conftest import provide


@pytest.mark.parametrize(
    ("name", "whole"), [("stack_four_blocks", "stack_blocks"), ("place_three_cups", "place_cups")]
)
def test_every_variation_is_one_of_the_whole_task_with_the_most_things(name, whole):
    task, of_whole = make_task(f"rlbench/{name}"), make_task(f"rlbench/{whole}")
    known = [of_whole.instructions(v) for v in range(of_whole.variations)]
    found = [known.index(task.instructions(v)) for v in range(task.variations)]
    assert len(set(found)) == task.variations
    assert all(any("3 cups" in text or "4 " in text for text in known[v]) for v in found)


@pytest.mark.parametrize(
    ("name", "whole", "steps"),
    [("stack_four_blocks", "stack_blocks", 23), ("place_three_cups", "place_cups", 21)],
)
def test_its_scenes_are_those_of_the_whole_task(name, whole, steps, tmp_path, monkeypatch):
    provided = provide(tmp_path, [whole])
    next(provided)
    monkeypatch.setattr(RLBenchTask, "_problem", lambda task, world: "")
    task, of_whole = make_task(f"rlbench/{name}"), make_task(f"rlbench/{whole}")
    world = make_scene(task, 0, 0, 4)
    assert len(task.waypoints(world)) == steps <= task.step_limit
    variation = [of_whole.instructions(v) for v in range(of_whole.variations)].index(task.instructions(0))
    other = make_scene(of_whole, variation, 0, 4)
    assert np.array_equal(world.data.qpos, other.data.qpos)
    provided.close()


def test_long_tasks_do_not_count_among_all():
    assert set(LONG) - set(RLBENCH) == {"rlbench/stack_four_blocks", "rlbench/place_three_cups"}
    assert SUITES["rlbench"]["all"] == RLBENCH
