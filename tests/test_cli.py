import json
import re
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from imop import DemonstrationStore
from imop.cli import Disturb, main
from imop.demos.frames import moved
from imop.evaluation.replay import ReplayPolicy
from imop.evaluation.trials import Trial, demonstration_for
from imop.geometry import se3
from imop.networks.model import load_model
from imop.robots.panda import T_WORLD_BASE
from imop.tasks.disturbances import DISTURBANCES
from imop.training.data.shards import write_shard
from imop.viewing.cases import from_result
from tests.training.data.test_pairs import pair

VERBS = (
    "check-task",
    "run",
    "collect",
    "eval",
    "record",
    "import",
    "export",
    "check",
    "predict",
    "tasks",
    "assets",
    "train",
    "model",
    "view",
)
POT = "tabletop/lid_off_pot"
CELL = Path(__file__).parents[1] / "examples" / "simulated_cell.toml"


def imop(*arguments):
    with pytest.raises(SystemExit) as stopped:
        main([str(a) for a in arguments])
    return stopped.value.code


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    path = tmp_path_factory.mktemp("data") / "pots.zarr"
    store = DemonstrationStore.create(path)
    store.append(demonstration_for(Trial(POT, 0)))
    return path


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_explains_itself(verb, capsys):
    assert imop(verb, "--help") == 0
    assert verb in capsys.readouterr().out


def test_help_lists_the_verbs(capsys):
    assert imop("--help") == 0
    out = capsys.readouterr().out
    assert all(verb in out for verb in VERBS)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("run", "--task", "tabletop/lid_of_pot"), "tabletop/lid_off_pot"),
        (("run", "--task", POT, "--seed", "-4"), "seed"),
        (("run", "--task", POT, "--variation", "9"), "variation"),
        (("run", "--task", POT, "--demo", "/nowhere"), "/nowhere"),
        (("run", "--task", POT, "--shown", "2", "--demo", "/nowhere"), "shown"),
        (("run", "--task", "rlbench/open_drawer", "--shown", "2"), "one instance"),
        (("eval", "--suite", "kitchen"), "suite"),
        (("eval", "--methods", "magic"), "methods"),
        (("eval", "--tasks", "juggle"), "tasks"),
        (("eval", "--episodes", "0"), "episodes"),
        (("eval", "--change", "darkness"), "table_color"),
        (("run", "--task", "tabletop/stack_cubes", "--change", "object_color"), "table_color"),
        (("check", "/nowhere"), "/nowhere"),
        (("import", "rlbench", "/nowhere", "/tmp/never.zarr"), "/nowhere"),
        (("predict", "--demo", "/nowhere", "--query", "/nowhere"), "/nowhere"),
        (("train", "--out", "/tmp/never"), "train"),
        (("train", "--out", "/tmp/never", "--train", "/nowhere", "--pose", "regressed"), "networks"),
        (("train", "--out", "/tmp/never", "--train", "/nowhere"), "/nowhere"),
        (("train", "--out", "/tmp/never", "--recipe", "small", "--steps", "5"), "steps"),
        (("train", "--out", "/tmp/never", "--recipe", "small", "--train", "/nowhere"), "train"),
        (("train", "--out", "/tmp/never", "--recipe", "small", "--no-region-first"), "region_first"),
        (("train", "--out", "/tmp/never", "--recipe", "small", "--size", "paper"), "size"),
        (("train", "--out", "/tmp/never", "--recipe", "small", "--jobs", "0"), "jobs"),
        (("train", "--out", "/tmp/never", "--train", "/nowhere", "--jobs", "2"), "jobs"),
        (("model", "--weights", "/nowhere"), "/nowhere"),
    ],
)
def test_bad_input_is_one_clear_line_and_exit_code_2(arguments, named, capsys):
    assert imop(*arguments) == 2
    error = capsys.readouterr().err
    assert error.startswith("error:") and error.count("\n") == 1 and named in error


def test_tasks_lists_the_suite(capsys):
    assert imop("tasks") == 0
    out = capsys.readouterr().out
    assert POT in out and "take the lid off the pot" in out


def test_a_successful_run_writes_result_picture_and_video(store, tmp_path, capsys):
    assert imop("run", "--task", POT, "--demo", store, "--method", "oracle", "--out", tmp_path) == 0
    out = capsys.readouterr().out
    assert "success" in out and str(tmp_path / "rollout.mp4") in out.replace("\n", "")
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["success"] and result["seed"] == 1 and len(result["steps"]) == 3
    assert (result["demo"], result["demo_episode"], result["weights"]) == (str(store), 0, None)
    assert max(step["position_error"] for step in result["steps"]) < 0.01
    assert (tmp_path / "steps.png").stat().st_size > 10_000
    assert (tmp_path / "rollout.mp4").stat().st_size > 10_000


def test_a_laptop_is_closed_after_another_one_was_shown_and_nothing_is_off(tmp_path, capsys):
    task = ("run", "--task", "tabletop/close_laptop", "--method", "oracle")
    which = ("--instance", "1", "--shown", "0", "--out", tmp_path, "--no-video")
    assert imop(*task, *which) == 0
    assert "instance 1 after 0" in capsys.readouterr().out
    result = json.loads((tmp_path / "result.json").read_text())
    assert (result["instance"], result["shown"]) == (1, 0)
    assert max(step["position_error"] for step in result["steps"]) < 1e-6


def test_replay_fails_in_another_scene_with_exit_code_1(store, tmp_path):
    code = imop("run", "--task", POT, "--demo", store, "--method", "replay", "--out", tmp_path, "--no-video")
    assert code == 1
    result = json.loads((tmp_path / "result.json").read_text())
    assert not result["success"] and result["steps"][0]["position_error"] > 0.02


def test_predict_of_the_demonstration_itself_is_exact_for_replay(store, tmp_path):
    assert imop("predict", "--demo", store, "--query", store, "--method", "replay", "--out", tmp_path) == 0
    steps = json.loads((tmp_path / "result.json").read_text())["steps"]
    assert np.allclose([step["position_error"] for step in steps], 0)
    case = from_result(tmp_path / "result.json")
    assert case.method == "replay" and len(case.demonstration) == len(steps)


def test_view_asks_in_the_terminal_and_moves_nothing_before_a_yes(store, monkeypatch, capsys):
    answers = iter(["n", "y", "q"])
    monkeypatch.setattr("imop.terminal.console.input", lambda question: next(answers))
    assert imop("view", "--demo", store, "--scene", store, "--method", "replay", "--confirm") == 1
    out = capsys.readouterr().out
    assert "all were rejected" in out and next(answers, None) is None
    for wrong in ((), ("--scene", store), ("--scene", store, "--task", POT)):
        assert imop("view", *wrong) == 2


def test_a_server_decides_what_is_viewed_and_what_it_needs_is_said(store, monkeypatch, capsys):
    pytest.importorskip("msgpack", reason="the extra serve is not installed")
    running = pytest.importorskip("tests.serving.running")
    monkeypatch.setattr("imop.viewing.command.console.input", lambda question: "q")
    recording = ("view", "--demo", store, "--scene", store, "--confirm")
    with running.serving(ReplayPolicy, key="secret") as server:
        address = f"127.0.0.1:{server.port}"
        assert imop(*recording, "--server", address, "--key", "secret") == 1
        assert "open" in capsys.readouterr().out
        assert imop(*recording, "--server", address, "--key", "wrong") == 2
    assert "401" in capsys.readouterr().err
    assert imop("view", "--robot", CELL) == 2
    assert "demo" in capsys.readouterr().err


def test_predict_takes_recordings_whose_table_is_at_height_0(store, tmp_path, capsys):
    T = se3.invert(T_WORLD_BASE)
    on_the_floor = DemonstrationStore.create(tmp_path / "base frame.zarr")
    on_the_floor.append(moved(DemonstrationStore.open(store)[0], T))
    shown = ("--demo", on_the_floor.path, "--query", on_the_floor.path, "--method", "registration")
    assert imop("predict", *shown, "--out", tmp_path) == 2
    assert "--base" in capsys.readouterr().err
    assert imop("predict", *shown, "--out", tmp_path, "--base", 0, 0, 0) == 0
    steps = json.loads((tmp_path / "result.json").read_text())["steps"]
    assert max(step["position_error"] for step in steps) < 0.01
    recorded = on_the_floor[0].keyframes[0].action.T_world_gripper
    assert np.allclose(steps[0]["T_world_gripper"][:3], recorded[:3, 3], atol=0.01)


def test_collect_appends_to_a_store_that_passes_the_check(tmp_path):
    path = tmp_path / "demos.zarr"
    for seed in (0, 1):
        arguments = ("--tasks", "lid_off_pot", "--episodes", 1, "--seed", seed, "--jobs", 1)
        assert imop("collect", "--out", path, *arguments) == 0
    first, second = DemonstrationStore.open(path)
    assert first.task == POT and first.seeds != second.seeds
    assert imop("check", path) == 0


def test_eval_writes_the_same_table_as_json_and_markdown(tmp_path, capsys):
    arguments = ("--tasks", "lid_off_pot", "--episodes", 2, "--jobs", 1, "--out", tmp_path)
    assert imop("eval", "--methods", "replay,oracle,expert", *arguments) == 0
    results = json.loads((tmp_path / "results.json").read_text())
    assert set(results) == {"suite", "split", "seed", "change", "instances", "disturb", "methods"}
    for method in ("oracle", "expert"):
        assert results["methods"][method]["tasks"]["lid_off_pot"] == {"successes": 2, "trials": 2}
    assert "lid_off_pot" in (tmp_path / "report.md").read_text()


def test_eval_goes_on_where_it_was_stopped(tmp_path, monkeypatch):
    arguments = ("eval", "--methods", "replay", "--tasks", "lid_off_pot", "--jobs", 1, "--out", tmp_path)
    assert imop(*arguments, "--episodes", 1) == 0
    before = (tmp_path / "episodes.jsonl").read_text()

    def nothing_to_try(trial):
        raise AssertionError(f"{trial} was tried again")

    monkeypatch.setattr(Trial, "env", nothing_to_try)
    assert imop(*arguments, "--episodes", 1) == 0
    assert (tmp_path / "episodes.jsonl").read_text() == before


def test_model_counts_what_the_paper_counts(capsys):
    assert imop("model", "--config", "paper") == 0
    out = capsys.readouterr().out
    assert all(name in out for name in ("region", "matching", "routing"))
    (millions,) = re.findall(r"\(([\d.]+) M\)", out)
    assert float(millions) == pytest.approx(80.8, rel=0.02)


def test_train_writes_weights_that_model_describes(tmp_path, capsys):
    (tmp_path / "shards").mkdir()
    write_shard([pair(0), pair(1)], tmp_path / "shards" / "0.npz")
    arguments = ("--train", tmp_path / "shards", "--steps", 1, "--batch", 1, "--workers", 0)
    assert imop("train", "--out", tmp_path / "run", "--attention", "graph", *arguments) == 0
    assert "step 1: focal" in capsys.readouterr().out
    assert load_model(tmp_path / "run").config.matching.attention == "graph"
    assert imop("model", "--weights", tmp_path / "run") == 0
    assert "matching" in capsys.readouterr().out


def test_every_disturbance_can_be_asked_for():
    assert set(get_args(Disturb)) == {"", *DISTURBANCES}
