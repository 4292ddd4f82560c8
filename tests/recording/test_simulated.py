import json

import numpy as np
import pytest

from imop.cli import main
from imop.demos.store import DemonstrationStore
from imop.geometry import se3
from imop.recording.folder import FRAMES, KEYFRAMES, read_folder


def run_cli(capsys, *arguments):
    with pytest.raises(SystemExit) as stopped:
        main(list(arguments))
    said = capsys.readouterr()
    return stopped.value.code, said.out, said.err


TASK = ("--simulated", "tabletop/open_drawer", "--seed", "3", "--size", "16", "12")


@pytest.fixture(scope="module")
def take(tmp_path_factory):
    pytest.importorskip("mujoco")
    from imop.recording.simulated import record_expert

    folder = tmp_path_factory.mktemp("takes") / "take"
    return folder, *record_expert(folder, "tabletop/open_drawer", seed=3, size=(16, 12))


def test_the_experts_steps_are_found_in_raw_frames(take):
    _, draft, expert = take
    assert np.median(np.diff(draft.source.motion.times)) == pytest.approx(1 / 15, abs=0.002)
    made = draft.demonstration()
    assert len(made) == len(expert)
    for found, wanted in zip(made.keyframes, expert.keyframes, strict=True):
        assert se3.near(found.action.T_world_gripper, wanted.action.T_world_gripper, 0.003, np.radians(1))
        assert found.action.gripper_open == wanted.action.gripper_open
        assert found.action.allow_collisions == wanted.action.allow_collisions
        assert found.observation.joint_velocities is None


def test_what_was_interrupted_goes_on_and_is_stored_by_the_same_command(take, tmp_path, capsys):
    folder = tmp_path / "take"
    whole = (take[0] / FRAMES).read_bytes()
    folder.mkdir()
    (folder / "recording.json").write_bytes((take[0] / "recording.json").read_bytes())
    (folder / FRAMES).write_bytes(b"".join(whole.splitlines(True)[:40]))
    for name in read_folder(take[0]).cameras:
        (folder / name).symlink_to(take[0] / name)
    store = ("--store", str(tmp_path / "s.zarr"))
    other = [part if part != "3" else "4" for part in TASK]
    code, _, err = run_cli(capsys, "record", str(folder), *other, *store)
    assert code == 2 and "'seed': 3" in err
    code, out, _ = run_cli(capsys, "record", str(folder), *TASK, *store)
    assert code == 0 and "--save" in out
    assert (folder / FRAMES).read_bytes() == whole
    frames = json.loads((folder / KEYFRAMES).read_text())["frames"]
    # Cameras of 16 x 12 pixels do not agree with each other well enough for the checker, which may say so.
    run_cli(capsys, "record", str(folder), "--move", "1:+1", *store, "--save")
    assert json.loads((folder / KEYFRAMES).read_text())["frames"][1] == frames[1] + 1
    assert len(DemonstrationStore.open(tmp_path / "s.zarr")) == 1
    assert (folder / "keyframes.png").is_file()


def test_nothing_to_record_is_said(tmp_path, capsys):
    code, _, err = run_cli(capsys, "record", str(tmp_path / "take"))
    assert code == 2 and "--simulated" in err
