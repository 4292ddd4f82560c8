import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from imop.errors import CorruptData, InvalidInput
from imop.recording.folder import FRAMES, read_folder
from imop.recording.keyframes_file import load_draft
from imop.recording.recorder import DemonstrationRecorder
from tests.recording import takes


def test_what_was_added_is_read_back(tmp_path):
    takes.record(tmp_path / "take")
    read = read_folder(tmp_path / "take")
    assert read.task == "test/lift" and read.instructions == ("lift it",) and read.kind == "kinesthetic"
    assert len(read.frames) == len(takes.moments())
    for number, state in list(enumerate(takes.moments()))[::9]:
        expected = takes.cell().observation(state, takes.frames(number), 3)
        found = read.observation(number, 3)
        assert list(found.views) == ["front", "wrist"] and found.time_step == 3
        np.testing.assert_allclose(found.T_world_gripper, expected.T_world_gripper, atol=1e-9)
        np.testing.assert_allclose(found.joint_positions, state.joint_positions)
        for name, view in expected.views.items():
            np.testing.assert_array_equal(found.views[name].rgb, view.rgb)
            np.testing.assert_allclose(found.views[name].depth, view.depth, atol=5.1e-5)
            np.testing.assert_allclose(found.views[name].T_world_camera, view.T_world_camera, atol=1e-9)
            np.testing.assert_allclose(found.views[name].intrinsics, view.intrinsics)


def test_an_interrupted_recording_is_continued_to_the_same(tmp_path):
    takes.record(tmp_path / "whole")
    takes.record(tmp_path / "parts", 0, 20)
    with (tmp_path / "parts" / FRAMES).open("ab") as lines:
        lines.write(b'{"stamp": 101.4, "T_wor')  # cut off while it was written
    assert len(read_folder(tmp_path / "parts").frames) == 20
    takes.record(tmp_path / "parts", 20)
    assert (tmp_path / "parts" / FRAMES).read_bytes() == (tmp_path / "whole" / FRAMES).read_bytes()


CHILD = """
import sys, time
from pathlib import Path
from imop.recording.recorder import DemonstrationRecorder
from tests.recording import takes
recorder = DemonstrationRecorder.start(Path(sys.argv[1]), takes.cell())
for number, state in enumerate(takes.moments()):
    recorder.add(takes.frames(number), state)
    print(state.stamp, flush=True)
time.sleep(60)
"""


def test_a_killed_recorder_loses_less_than_a_second(tmp_path):
    command = [sys.executable, "-c", CHILD, str(tmp_path / "take")]
    root = Path(__file__).parents[2]
    places = os.pathsep.join([str(root), str(root / "src"), os.environ.get("PYTHONPATH", "")])
    with subprocess.Popen(command, stdout=subprocess.PIPE, env={**os.environ, "PYTHONPATH": places}) as child:
        added = [float(child.stdout.readline()) for _ in range(40)]
        child.send_signal(signal.SIGKILL)
    kept = read_folder(tmp_path / "take")
    assert added[-1] - kept.frames[-1].stamp < 1.0
    kept.observation(len(kept.frames) - 1)  # its images are whole


def test_what_cannot_be_added_is_named(tmp_path):
    state, seen = takes.moments()[0], takes.frames(0)
    with DemonstrationRecorder.start(tmp_path / "take", takes.cell()) as recorder:
        with pytest.raises(InvalidInput, match="d405"):
            recorder.add({"front": seen["front"]}, state)
        recorder.add(seen, state)
        with pytest.raises(InvalidInput, match="stamp"):
            recorder.add(seen, state)
        other = {
            name: replace(frame, intrinsics=1.1 * frame.intrinsics + np.diag([0, 0, -0.1]))
            for name, frame in seen.items()
        }
        with pytest.raises(InvalidInput, match="intrinsics"):
            recorder.add(other, replace(state, stamp=200.0))
        smaller = {name: replace(f, rgb=f.rgb[:4], depth=f.depth[:4]) for name, f in seen.items()}
        with pytest.raises(InvalidInput, match="pixels"):
            recorder.add(smaller, replace(state, stamp=200.0))
        assert recorder.count == 1


def test_the_intrinsics_are_those_of_the_driver(tmp_path):
    K = takes.K + np.array([[0.5, 0, 0], [0, 0.5, 0], [0, 0, 0]])
    with DemonstrationRecorder.start(tmp_path / "take", takes.cell()) as recorder:
        for number, state in list(enumerate(takes.moments()))[:2]:
            recorder.add({n: replace(f, intrinsics=K) for n, f in takes.frames(number).items()}, state)
    np.testing.assert_allclose(read_folder(tmp_path / "take").observation(0).views["front"].intrinsics, K)


def test_folders_of_others_are_not_written_into(tmp_path):
    (tmp_path / "thesis.txt").write_text("mine")
    with pytest.raises(InvalidInput, match="something else"):
        DemonstrationRecorder.start(tmp_path, takes.cell())
    takes.record(tmp_path / "take")
    fewer = replace(takes.cell(), cameras={"front": takes.cell().cameras["front"]})
    with pytest.raises(InvalidInput, match="wrist"):
        DemonstrationRecorder.start(tmp_path / "take", fewer)


def test_what_was_stopped_has_ended(tmp_path):
    recorder = DemonstrationRecorder.start(tmp_path / "take", takes.cell())
    for number, state in enumerate(takes.moments()):
        recorder.add(takes.frames(number), state)
    draft = recorder.stop()
    assert load_draft(tmp_path / "take").frames == draft.frames
    with pytest.raises(InvalidInput, match="ended"):
        DemonstrationRecorder.start(tmp_path / "take", takes.cell())
    (tmp_path / "take" / "keyframes.json").write_text("{}")
    with pytest.raises(CorruptData, match=r"keyframes\.json"):
        load_draft(tmp_path / "take")
