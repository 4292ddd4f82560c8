"""Every pair of what is shown and what is tried: what is counted, what is kept and what is written."""

import json
import sys

import pytest
from benchmarks.cross_object import NAMES, Options, as_dict, main, markdown, measure
from rich.console import Console

from imop.errors import InvalidInput
from imop.evaluation import benchmark
from imop.evaluation.episodes import Episode, read_episodes
from imop.evaluation.trials import Trial

TWO = f"{NAMES[0]},{NAMES[4]}"
QUIET = Console(quiet=True)
LOST = """
from imop.errors import InvalidInput

class Lost:
    def watch(self, demonstration):
        pass

    def reset(self):
        pass

    def act(self, observation):
        raise InvalidInput("observation", "nothing to see", "something")
"""


def options(tmp_path, **others):
    return Options(
        **{"method": "oracle", "groceries": TWO, "trials": 1, "out": tmp_path, "jobs": 1, **others}
    )


def episode(success, error=False):
    return Episode(Trial("task", 0), "m", "s", success, "reason", error=error)


def test_every_pair_is_tried_once_and_the_demonstration_shows_the_other_grocery(tmp_path, monkeypatch):
    cells = measure(options(tmp_path), QUIET)
    tried = [e.trial for episodes in cells.values() for e in episodes]
    assert [(t.shown_variation, t.variation) for t in tried] == [(0, 0), (0, 4), (4, 0), (4, 4)]
    assert {t.demonstrated.variation for t in tried[:2]} == {0}
    assert all(e.success for episodes in cells.values() for e in episodes)
    # What was tried is not tried again, and no demonstration is needed for it.
    monkeypatch.setattr(benchmark, "demonstrations_for", never)
    monkeypatch.setattr(benchmark, "attempt", never)
    assert measure(options(tmp_path), QUIET) == cells
    diagonal = measure(options(tmp_path, diagonal=True), QUIET)
    assert list(diagonal) == [(name, name) for name in TWO.split(",")]


def never(*_):
    raise AssertionError("was tried already")


def test_a_run_that_was_stopped_goes_on_and_other_code_begins_anew(tmp_path, monkeypatch):
    done = []

    def attempt(trial, demonstration, method, state, weights, focus):
        if len(done) == 3:
            raise KeyboardInterrupt
        done.append((trial, state))
        return Episode(trial, method, state, True, "success")

    monkeypatch.setattr(benchmark, "attempt", attempt)
    monkeypatch.setattr(benchmark, "demonstrations_for", lambda *_: [None])
    with pytest.raises(KeyboardInterrupt):
        measure(options(tmp_path), QUIET)
    kept = [(e.trial, e.state) for e in read_episodes(tmp_path / "episodes.jsonl")]
    assert kept and kept == done[: len(kept)]
    done.clear()
    measure(options(tmp_path), QUIET)
    assert len(done) == 4 - len(kept) and not {t for t, _ in done} & {t for t, _ in kept}
    done.clear()
    monkeypatch.setattr(benchmark, "method_state", lambda *_: "other code")
    with pytest.raises(KeyboardInterrupt):
        measure(options(tmp_path), QUIET)
    assert {state for _, state in done} == {"other code"}


def test_an_error_is_told_from_a_failure_in_everything_that_is_written(tmp_path, monkeypatch, capsys):
    (tmp_path / "lost_policy.py").write_text(LOST)
    monkeypatch.syspath_prepend(tmp_path)
    arguments = ["--method", "lost_policy:Lost", "--groceries", TWO, "--trials", "1", "--jobs", "1"]
    monkeypatch.setattr(sys, "argv", ["cross_object.py", *arguments, "--diagonal", "--out", str(tmp_path)])
    assert main() == 0
    assert "0 of 1 (1 error)" in capsys.readouterr().out
    assert "0 of 1 (1 error)" in (tmp_path / "report.md").read_text()
    results = json.loads((tmp_path / "results.json").read_text())
    assert [cell and cell["errors"] for row in results["matrix"] for cell in row] == [1, None, None, 1]
    assert [error["shown"] for error in results["errors"]] == TWO.split(",")
    assert all("nothing to see" in error["reason"] for error in results["errors"])


def test_the_diagonal_and_the_rest_are_counted_apart_and_no_scene_is_no_trial():
    cells = {
        ("can", "can"): [episode(True), episode(True)],
        ("can", "jar"): [episode(True), episode(False)],
        ("jar", "can"): [episode(False, error=True), episode(None)],
        ("jar", "jar"): [episode(True), episode(False)],
    }
    found = as_dict(cells)
    assert (found["same_grocery"]["successes"], found["same_grocery"]["trials"]) == (3, 4)
    other = found["another_grocery"]
    assert (other["successes"], other["trials"], other["errors"], other["without_scene"]) == (1, 3, 1, 1)
    assert other["interval"][0] < 1 / 3 < other["interval"][1]
    written = markdown(cells, "learned")
    assert "| can | 2 of 2 | 1 of 2 |" in written and "| jar | 0 of 1 (1 error) | 1 of 2 |" in written
    assert "same grocery: 75 % [30, 95] (3 of 4)" in written


@pytest.mark.parametrize("wrong", [{"groceries": "stone"}, {"trials": 0}, {"method": "no_method"}])
def test_what_cannot_be_tried_is_named_before_anything_is(tmp_path, wrong, monkeypatch):
    monkeypatch.setattr(benchmark, "demonstrations_for", never)
    with pytest.raises(InvalidInput, match=next(iter(wrong))):
        measure(options(tmp_path, **wrong), QUIET)
    assert not list(tmp_path.iterdir())
