"""Every verb, given what cannot be used, says so in one line and exits with 2."""

import errno
import os

import pytest

from imop.cli import main
from imop.demos.store import DemonstrationStore
from imop.training.data.shards import write_shard
from tests.demos.rlbench_files import write_episode
from tests.demos.scenes import lift_a_cube
from tests.tasks.coppelia.conftest import cupboard
from tests.training.data.test_pairs import pair

POT = "tabletop/lid_off_pot"
LID = ("--tasks", "lid_off_pot")


@pytest.fixture(scope="module")
def given(tmp_path_factory):
    """Input that is right, by what it is."""
    folder = tmp_path_factory.mktemp("given [red]")
    DemonstrationStore.create(folder / "store").append(lift_a_cube())
    write_episode(folder / "episode", lift_a_cube())
    (folder / "models").mkdir()
    (folder / "models" / "cupboard.ttm").write_bytes(cupboard())
    (folder / "shards").mkdir()
    write_shard([pair(0)], folder / "shards" / "0.npz")
    (folder / "file").write_text("no folder")
    (folder / "dangling").symlink_to(folder / "nowhere")
    return folder


WRITES = {
    "run": lambda given, out: ("--task", POT, "--out", out),
    "collect": lambda given, out: (*LID, "--out", out),
    "eval": lambda given, out: (*LID, "--out", out),
    "import": lambda given, out: ("rlbench", given / "episode", out),
    "export": lambda given, out: ("rlbench", given / "store", out),
    "predict": lambda given, out: ("--demo", given / "store", "--query", given / "store", "--out", out),
    "tasks": lambda given, out: ("--contact-sheet", out / "sheet.png"),
    "assets": lambda given, out: ("rlbench", "--from", given / "models"),
    "train": lambda given, out: ("--train", given / "shards", "--out", out, "--steps", 1),
}
OUTPUTS = {
    "below a file": lambda given: given / "file" / "out [/red]",
    "a dangling link": lambda given: given / "dangling" / "out",
    "too long a name": lambda given: given / ("n" * 300),
}


def fails(capsys, *arguments):
    with pytest.raises(SystemExit) as stopped:
        main([str(a) for a in arguments])
    captured = capsys.readouterr()
    assert stopped.value.code == 2, captured
    assert captured.err.startswith("error: ") and captured.err.count("\n") == 1, captured.err
    assert "Traceback" not in captured.err + captured.out
    return captured.err


@pytest.mark.parametrize("output", OUTPUTS)
@pytest.mark.parametrize("verb", WRITES)
def test_an_output_that_cannot_be_written(verb, output, given, capsys, monkeypatch, tmp_path):
    out = OUTPUTS[output](given)
    monkeypatch.setenv("XDG_CACHE_HOME", str(out if verb == "assets" else tmp_path))
    shown = fails(capsys, verb, *WRITES[verb](given, out))
    assert str(given) in shown


MISSING = {
    "run": ("--task", POT, "--demo", "{}"),
    "import": ("rlbench", "{}", "never.zarr"),
    "export": ("rlbench", "{}", "never"),
    "check": ("{}",),
    "predict": ("--query", "{}", "--demo", "{}"),
    "assets": ("rlbench", "--from", "{}"),
    "train": ("--train", "{}", "--out", "never", "--steps", "1"),
    "model": ("--weights", "{}"),
}


@pytest.mark.parametrize("name", ["nowhere", "file", "dangling", "no [red]thing[/red] :bug: [/]", "n" * 300])
@pytest.mark.parametrize("verb", MISSING)
def test_an_input_that_is_not_there(verb, name, given, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    path = given / name
    shown = fails(capsys, verb, *(a.format(path) for a in MISSING[verb]))
    assert str(path) in shown
    assert not (tmp_path / "never").exists() or not any((tmp_path / "never").rglob("*.safetensors"))


NONSENSE = [
    ("run", "--task", POT, "--seed", "-1"),
    ("run", "--task", POT, "--instance", "-1"),
    ("run", "--task", POT, "--variation", "-1"),
    ("run", "--task", POT, "--min-confidence", "nan"),
    ("run", "--task", POT, "--min-confidence", "2"),
    ("collect", *LID, "--episodes", "0"),
    ("collect", *LID, "--seed", "-1"),
    ("collect", *LID, "--jobs", "0"),
    ("collect", *LID, "--scenes", "0"),
    ("eval", *LID, "--episodes", "-3"),
    ("eval", *LID, "--seed", "-1"),
    ("eval", *LID, "--instance", "-1"),
    ("eval", *LID, "--jobs", "0"),
    ("tasks", "--contact-sheet", "sheet.png", "--jobs", "0"),
    ("train", "--steps", "0"),
    ("train", "--steps", "1", "--batch", "0"),
    ("train", "--steps", "1", "--learning-rate", "nan"),
    ("train", "--steps", "1", "--workers", "-1"),
    ("train", "--steps", "1", "--ema", "1.5"),
    ("train", "--steps", "1", "--every", "0"),
    ("train", "--steps", "1", "--neighbours", "0"),
]


@pytest.mark.parametrize("arguments", NONSENSE, ids=" ".join)
def test_numbers_that_make_no_sense(arguments, given, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    needs = {"train": ("--train", given / "shards", "--out", "out"), "collect": ("--out", "out")}
    shown = fails(capsys, *arguments, *needs.get(arguments[0], ()))
    assert arguments[-2].strip("-").replace("-", "_") in shown.replace("-", "_")


@pytest.mark.parametrize("episode", [-1, 1])
@pytest.mark.parametrize("which", ["demo", "query"])
def test_an_episode_that_a_store_does_not_have(which, episode, given, capsys):
    store = given / "store"
    shown = fails(capsys, "predict", "--demo", store, "--query", store, f"--{which}-episode", episode)
    assert "episode" in shown and str(store) in shown


def test_numbers_that_are_none_are_refused_by_the_parser(capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["run", "--task", POT, "--seed", "many"])
    assert stopped.value.code == 2 and "--seed" in capsys.readouterr().err


def test_a_full_disk(given, tmp_path, capsys, monkeypatch):
    def full(*arguments):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "result.json")

    monkeypatch.setattr(os, "replace", full)
    store = given / "store"
    replay = ("--method", "replay", "--out", tmp_path)
    assert "No space left" in fails(capsys, "predict", "--demo", store, "--query", store, *replay)
