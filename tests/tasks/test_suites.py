"""Names of tasks and suites of one's own that cannot be used are refused when they are looked up."""

import pytest

from imop.errors import InvalidInput
from imop.tasks.suites import find_suite, find_task

MODULE = """
from imop.tasks.tabletop.lid_off_pot import LidOffPot

class Sized(LidOffPot):
    def __init__(self, size):
        self.size = size

WITH_SLASH = {"novel": {"pots/lid": LidOffPot}}
NUMBERED = {"novel": {1: LidOffPot}}
OF_SIZED = {"novel": {"sized": Sized}}
LIDS = {"novel": {"lid": LidOffPot}}
"""


@pytest.fixture(autouse=True)
def module(tmp_path, monkeypatch):
    (tmp_path / "pots_of_mine.py").write_text(MODULE)
    monkeypatch.syspath_prepend(tmp_path)


@pytest.mark.parametrize(
    ("find", "name", "told"),
    [
        (find_task, "Sized", "needs arguments"),
        (find_suite, "OF_SIZED", "needs arguments"),
        (find_suite, "WITH_SLASH", "'pots/lid'"),
        (find_suite, "NUMBERED", "has a task 1"),
    ],
)
def test_what_could_not_be_made_or_named_is_refused(find, name, told):
    with pytest.raises(InvalidInput, match=told):
        find(f"pots_of_mine:{name}")


def test_a_task_by_its_own_entry_point_may_be_called_as_if_it_were_of_a_suite(tmp_path, monkeypatch):
    info = tmp_path / "pots-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: pots\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[imop.suites]\npots = pots_of_mine:LIDS\n[imop.tasks]\npots/other = imop.tasks.tabletop:OpenBox\n"
    )
    assert find_task("pots/lid").__name__ == "LidOffPot"
    assert find_task("pots/other").__name__ == "OpenBox"
    with pytest.raises(InvalidInput, match="pots/lid"):
        find_task("pots/lit")
