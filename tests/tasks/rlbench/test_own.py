"""The task of one's own that docs/rlbench.md shows, as a user has it: a file outside the package."""

import runpy
from pathlib import Path

import pytest

from imop.tasks.expert import perform
from imop.tasks.task import make_scene
from tests.tasks.rlbench.conftest import provide

EXAMPLE = Path(__file__).parents[3] / "examples" / "rlbench_close_drawer.py"


@pytest.fixture(scope="module", autouse=True)
def model_file(tmp_path_factory):
    yield from provide(tmp_path_factory.mktemp("cache"), ["open_drawer"])


@pytest.mark.parametrize("seed", [0, 1])
def test_the_expert_closes_the_drawer_that_stands_open(seed):
    task = runpy.run_path(str(EXAMPLE))["CloseDrawer"]()
    world = make_scene(task, seed, 0, seed)
    assert not task.success(world)
    assert world.joint(task.joint) > 0.09
    perform(task, world)
    assert task.success(world)
    assert world.joint(task.joint) < 0.02


def test_the_docs_show_the_code_that_is_tested():
    assert f'--8<-- "examples/{EXAMPLE.name}"' in (EXAMPLE.parents[1] / "docs" / "rlbench.md").read_text()


def test_it_is_as_short_as_the_docs_say():
    assert len(EXAMPLE.read_text().splitlines()) <= 40
