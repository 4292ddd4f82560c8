from contextlib import nullcontext
from dataclasses import replace

import pytest

from imop.calibration.collect import Rig
from imop.cli import main
from imop.errors import InvalidInput
from imop.recording import live
from imop.recording.folder import read_folder
from imop.recording.live import GAP, record_live
from imop.recording.recorder import DemonstrationRecorder
from imop.robots.interfaces import DONE
from imop.setup import drivers
from imop.setup.file import save_setup
from tests.recording import takes


class Arm:
    """Tells one moment after the other, and what it was told."""

    def __init__(self, later=0.0):
        self.told, self._moments, self._later = [], iter(takes.moments()), later

    def state(self):
        state = next(self._moments)
        return replace(state, stamp=state.stamp + self._later)

    def move_gripper(self, opening):
        self.told.append(opening)
        return DONE


class Eye:
    def __init__(self, name):
        self._name, self._number = name, -1

    def capture(self):
        self._number += 1
        return takes.frames(self._number)[self._name]


def rig(later=0.0):
    return Rig(Arm(later), {"front": Eye("front"), "d405": Eye("d405")})


def typed(*lines):
    waiting = iter(lines)
    return lambda: next(waiting)


def test_it_records_until_an_empty_line(tmp_path):
    cell = rig()
    with DemonstrationRecorder.start(tmp_path / "take", takes.cell()) as recorder:
        record_live(recorder, cell, 200.0, typed(None, None, "c", None, "o", ""))
    assert cell.robot.told == [0.0, 1.0] and recorder.count == 5


def test_a_clock_that_began_anew_goes_on_after_a_gap(tmp_path):
    for later in (0.0, -50.0):
        with DemonstrationRecorder.start(tmp_path / "take", takes.cell()) as recorder:
            record_live(recorder, rig(later), 200.0, typed(None, None, None, ""))
    stamps = read_folder(tmp_path / "take").motion.times
    assert len(stamps) == 6 and stamps[3] - stamps[2] == pytest.approx(GAP)


def test_the_set_up_names_the_drivers(tmp_path, monkeypatch):
    cell, count = tmp_path / "cell.toml", len(list(takes.moments()))
    save_setup(takes.cell(), cell)
    monkeypatch.setattr(drivers, "connected", lambda setup: nullcontext((Arm(), rig().cameras)))
    monkeypatch.setattr(live, "typed_lines", lambda: typed(*[None] * count, ""))
    with pytest.raises(SystemExit) as ended:
        main(["record", str(tmp_path / "take"), "--setup", str(cell), "--rate", "200"])
    assert not ended.value.code
    assert len(read_folder(tmp_path / "take").motion) == count


def test_a_rate_has_limits(tmp_path):
    with (
        DemonstrationRecorder.start(tmp_path / "take", takes.cell()) as recorder,
        pytest.raises(InvalidInput, match="rate"),
    ):
        record_live(recorder, rig(), 0.0, typed(""))
