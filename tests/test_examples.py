"""Every numbered example runs, is short, and says in the end what it should."""

import runpy
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "examples"
LAST_LINE = {
    "01_first_policy": "success",
    "02_own_demonstration": "a demonstration of 3 steps",
    "03_own_camera_rig": "points of what stands on the table",
    "04_own_task": "of 2 scenes",
    "05_batch_evaluation": "replay: 0 of 3",
    "06_own_matcher": "gripper to",
    "07_training_on_own_demonstrations": "imop run",
    "08_serving": "success",
    "09_what_the_networks_think": "probability",
}


def test_every_example_is_run_and_fits_on_a_screen():
    found = sorted(FOLDER.glob("[0-9]*.py"))
    assert [path.stem for path in found] == sorted(LAST_LINE)
    assert all(len(path.read_text().splitlines()) <= 40 for path in found)


@pytest.mark.parametrize("name", LAST_LINE)
def test_the_example_runs(name, tmp_path, monkeypatch, capfd):
    monkeypatch.syspath_prepend(FOLDER)
    monkeypatch.setattr("sys.argv", [f"{name}.py", str(tmp_path)])
    runpy.run_path(str(FOLDER / f"{name}.py"), run_name="__main__")
    assert LAST_LINE[name] in capfd.readouterr().out.splitlines()[-1]
