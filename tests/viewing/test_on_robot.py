"""`imop run --robot CELL.toml` from the command line to the task's aim, on the simulated drivers."""

import json
from pathlib import Path

import pytest

from imop import DemonstrationStore
from imop.cli import main
from imop.sim.driver import SimulatedRobot
from imop.tasks.env import make_task
from imop.tasks.expert import record_demonstration

CELL = Path(__file__).parents[2] / "examples" / "simulated_cell.toml"
TASK = "tabletop/open_drawer"


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    path = tmp_path_factory.mktemp("data") / "shown.zarr"
    DemonstrationStore.create(path).append(record_demonstration(make_task(TASK), 1, 0, 0))
    return path


def run(out, *arguments):
    with pytest.raises(SystemExit) as stopped:
        main(["run", "--robot", str(CELL), "--out", str(out), *map(str, arguments)])
    return stopped.value.code


def result(out):
    return json.loads((out / "result.json").read_text())


@pytest.fixture
def again(store):
    """The demonstrated motions in the demonstrated scene: quick, and the aim is reached."""
    return "--demo", store, "--task", TASK, "--seed", 1, "--method", "replay"


def test_a_task_is_performed_and_its_aim_is_reached(again, tmp_path, capsys):
    assert run(tmp_path, *again) == 0
    told = result(tmp_path)
    assert told["success"] and told["reason"] == "success" and (tmp_path / "steps.png").is_file()
    assert told["task"] == TASK and Path(told["setup"]) == CELL
    assert all(step["plan_failed"] is None and step["motion_seconds"] > 0 for step in told["steps"])
    assert "success" in capsys.readouterr().out


def test_nothing_moves_before_somebody_agrees(again, tmp_path, monkeypatch, capsys):
    answers = iter(["", "y", "q"])
    monkeypatch.setattr("imop.viewing.command.console.input", lambda question: next(answers))
    assert run(tmp_path, *again, "--confirm") == 1
    told = result(tmp_path)
    assert len(told["steps"]) == 1 and not told["success"] and "attended" in told["reason"]


def test_an_interrupt_stops_the_arm_and_what_was_done_is_kept(again, tmp_path, monkeypatch):
    state, looks, stopped = SimulatedRobot.state, [], []

    def interrupted(robot):
        looks.append(robot)
        if robot._seen is not None and len(looks) > 2 and not stopped:
            raise KeyboardInterrupt
        return state(robot)

    monkeypatch.setattr(SimulatedRobot, "state", interrupted)
    stop = SimulatedRobot.stop
    monkeypatch.setattr(SimulatedRobot, "stop", lambda robot: (stopped.append(1), stop(robot)))
    assert run(tmp_path, *again) == 130
    assert stopped and result(tmp_path)["reason"] == "interrupted"


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ((), "demo"),
        (("--demo", "/nowhere"), "/nowhere"),
        (("--demo", "/nowhere", "--shown", 3), "shown"),
        (("--demo", "/nowhere", "--disturb", "moved"), "disturb"),
    ],
)
def test_what_cannot_be_is_one_line(arguments, named, tmp_path, capsys):
    assert run(tmp_path, *arguments) == 2
    error = capsys.readouterr().err
    assert error.startswith("error:") and error.count("\n") == 1 and named in error


def test_simulated_drivers_need_a_task_and_real_ones_refuse_one(store, tmp_path, capsys):
    assert run(tmp_path, "--demo", store) == 2
    assert "task" in capsys.readouterr().err
    real = tmp_path / "real.toml"
    real.write_text(CELL.read_text().replace('driver = "simulated"', 'driver = "franka"\naddress = "x"', 1))
    with pytest.raises(SystemExit):
        main(["run", "--robot", str(real), "--demo", str(store), "--task", TASK, "--out", str(tmp_path)])
    assert "no task" in capsys.readouterr().err
