"""A task, a suite and a method from outside the package, by the command line and from Python."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from imop import DemonstrationStore, Task, check_task, make_task
from imop.errors import InvalidInput
from imop.evaluation.methods import make_policy
from imop.tasks.suites import find_suite, find_task

EXAMPLES = Path(__file__).parents[1] / "examples"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a package of somebody, who has not installed it."""
    package = tmp_path_factory.mktemp("somewhere") / "kitchen_of_mine"
    package.mkdir()
    (package / "__init__.py").touch()
    shutil.copy(EXAMPLES / "my_task.py", package / "my_task.py")
    suite = (EXAMPLES / "my_suite.py").read_text()
    (package / "my_suite.py").write_text(suite.replace("from my_task", "from kitchen_of_mine.my_task"))
    return package.parent


TASK, SUITE = "kitchen_of_mine.my_task:LiftBlock", "kitchen_of_mine.my_suite:SUITE"
METHOD = "kitchen_of_mine.my_suite:Repeat"


def imop(folder, *arguments):
    command = "import sys; from imop.cli import main; sys.path.remove(''); main()"
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-c", command, *map(str, arguments)],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
    )
    assert "Traceback" not in done.stderr, done.stderr
    return done


def test_run_performs_a_task_of_ones_own(folder):
    done = imop(folder, "run", "--task", TASK, "--method", "oracle", "--no-video", "--out", "run")
    assert done.returncode == 0, done.stdout + done.stderr
    assert json.loads((folder / "run" / "result.json").read_text())["task"] == TASK


def test_eval_tries_again_what_was_edited_and_nothing_else(folder):
    methods = ("--methods", f"{METHOD},expert", "--episodes", 2, "--jobs", 2, "--out", "eval")

    def evaluated():
        done = imop(folder, "eval", "--suite", SUITE, *methods)
        assert done.returncode == 0, done.stdout + done.stderr
        lines = (folder / "eval" / "episodes.jsonl").read_text().splitlines()
        return [json.loads(line) for line in lines]

    first = evaluated()
    assert {(e["method"], e["trial"]["task"]) for e in first} == {
        (method, f"{SUITE}/lift_block") for method in (METHOD, "expert")
    }
    assert all(e["success"] for e in first if e["method"] == "expert")
    results = json.loads((folder / "eval" / "results.json").read_text())
    assert results["methods"]["expert"]["tasks"] == {"lift_block": {"successes": 2, "trials": 2}}
    assert evaluated() == first
    source = folder / "kitchen_of_mine" / "my_task.py"
    source.write_text(source.read_text().replace("> 0.85", "> 0.86"))
    again = evaluated()[len(first) :]
    assert [e["trial"] for e in again] == [e["trial"] for e in first]
    assert {e["state"] for e in again}.isdisjoint(e["state"] for e in first)
    source.write_text(source.read_text().replace("> 0.86", "> 0.85"))
    assert evaluated()[: len(first) + len(again)] == first + again


def test_collect_goes_on_with_a_task_of_ones_own(folder):
    for new in (1, 0):
        done = imop(folder, "collect", "--suite", SUITE, "--episodes", 1, "--out", "demos.zarr")
        assert f"1 demonstrations in demos.zarr, {new} of them new" in done.stdout, done.stderr
    (demonstration,) = DemonstrationStore.open(folder / "demos.zarr")
    assert demonstration.task == f"{SUITE}/lift_block" and len(demonstration) == 3


def test_tasks_lists_a_suite_with_one_split(folder):
    done = imop(folder, "tasks", "--suite", SUITE)
    assert done.returncode == 0 and "novel, 1 variation" in done.stdout


@pytest.fixture
def here(monkeypatch):
    monkeypatch.chdir(EXAMPLES)


def test_the_template_is_short_and_passes_the_check(here):
    assert len((EXAMPLES / "my_task.py").read_text().splitlines()) <= 40
    assert check_task("my_task:LiftBlock") == []


def test_the_check_finds_a_task_that_is_done_before_it_begins(here):
    kind = find_task("my_task:LiftBlock")
    done = type("Done", (kind,), {"success": lambda self, world: True})
    assert any("untouched" in problem for problem in check_task(done))


def test_the_check_finds_an_expert_that_fails(here):
    kind = find_task("my_task:LiftBlock")
    asleep = type("Asleep", (kind,), {"success": lambda self, world: False})
    assert any("the expert fails" in problem for problem in check_task(asleep))


def test_the_check_finds_waypoints_on_nothing_that_is_seen(here):
    kind = find_task("my_task:LiftBlock")

    def waypoints(self, world):
        shown = kind.waypoints(self, world)
        T = world.pose("block/body")
        return [type(w)("world", T @ w.T_frame_gripper, w.gripper_open, w.allow_collisions) for w in shown]

    blind = type("Blind", (kind,), {"waypoints": waypoints})
    assert any("no camera sees" in problem for problem in check_task(blind))


def test_the_check_finds_scenes_that_do_not_follow_from_the_seed(here):
    kind = find_task("my_task:LiftBlock")
    calls = iter(range(100))

    def reset(self, world, rng):
        kind.reset(self, world, np.random.default_rng(next(calls)))

    random = type("Random", (kind,), {"reset": reset})
    assert any("two scenes of seed" in problem for problem in check_task(random))
    fixed = type("Fixed", (kind,), {"reset": lambda self, world, rng: self.arrange(world, rng)})
    assert any("where they were" in problem for problem in check_task(fixed))


def test_names_lead_to_what_they_name(here):
    assert find_task("my_suite:SUITE/lift_block") is find_task("my_task:LiftBlock")
    assert list(find_suite("my_suite:SUITE")["all"]) == ["my_suite:SUITE/lift_block"]
    assert make_task("my_task:LiftBlock").name == "my_task:LiftBlock"
    assert type(make_policy("my_suite:Repeat")).__name__ == "Repeat"


@pytest.mark.parametrize(
    ("find", "name", "told"),
    [
        (find_task, "my_task:Nothing", "has no attribute 'Nothing'"),
        (find_task, "no_module:Nothing", "No module named 'no_module'"),
        (find_task, "my_suite:SUITE", "my_suite:SUITE"),
        (find_task, "my_suite:SUITE/fly", "my_suite:SUITE/lift_block"),
        (find_task, "imop:Task", "does not define"),
        (find_task, "tabletop/lid_of_pot", "tabletop/lid_off_pot"),
        (find_suite, "my_task:LiftBlock", "split -> name"),
        (find_suite, "kitchen", "tabletop, rlbench"),
        (make_policy, "my_suite:SUITE", "watch, reset and act"),
        (make_policy, "my_task:LiftBlock", "watch, reset and act"),
        (make_policy, "magic", "registration"),
    ],
)
def test_names_of_something_else_are_refused(here, find, name, told):
    with pytest.raises(InvalidInput) as caught:
        find(name)
    assert told in str(caught.value) and len(str(caught.value)) < 500


def test_installed_packages_offer_theirs_by_entry_points(tmp_path, monkeypatch, here):
    info = tmp_path / "kitchen-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: kitchen\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[imop.tasks]\nkitchen/lift = my_task:LiftBlock\n"
        "[imop.suites]\nkitchen = my_suite:SUITE\n"
        "[imop.methods]\nrepeat = my_suite:Repeat\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    assert issubclass(find_task("kitchen/lift_block"), Task)
    assert list(find_suite("kitchen")["novel"]) == ["kitchen/lift_block"]
    assert type(make_policy("repeat")).__name__ == "Repeat"
