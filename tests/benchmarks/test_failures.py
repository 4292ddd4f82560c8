"""Failed episodes are acted again after the demonstration that they had."""

from types import SimpleNamespace

import pytest
from benchmarks.failures import Options, as_dict, failed, look, together

from benchmarks import failures
from imop.evaluation.episodes import Episode, EpisodeLog
from imop.evaluation.trials import Trial

POT, GROCERY = "tabletop/lid_off_pot", "tabletop/grocery_in_cupboard"
TRIALS = [
    Trial(POT, 1, 0, 4, shown=0),
    Trial(POT, 2, 0, 5, shown=0),
    Trial(POT, 1, 0, 4, shown=2),
    Trial(POT, 1, 0, 4),
    Trial(GROCERY, 1, 3, shown_variation=6),
    Trial(GROCERY, 1, 3),
]


@pytest.fixture
def groups(tmp_path):
    log = EpisodeLog(tmp_path / "episodes.jsonl")
    for trial in TRIALS:
        log.add(Episode(trial, "learned", "s", False, "task not done"))
    return together(failed(Options(tmp_path / "episodes.jsonl", tmp_path)))


def test_scenes_share_a_demonstration_only_if_it_shows_the_same(groups):
    assert groups == [TRIALS[:2], *([trial] for trial in TRIALS[2:])]


def test_every_scene_is_acted_again_after_its_own_demonstration(groups, monkeypatch):
    def record(task, seed, variation, instance, **_):
        return SimpleNamespace(shown=(task.name, variation, instance))

    acted = {}
    monkeypatch.setattr("imop.evaluation.trials.record_demonstration", record)
    monkeypatch.setattr("imop.evaluation.trials._seen", lambda demonstration, _: demonstration)
    monkeypatch.setattr(failures, "diagnose", lambda trial, shown, *_: acted.update({trial: shown.shown}))
    for group in groups:
        look(group, "learned", None)
    wanted = [(POT, 0, 0), (POT, 0, 0), (POT, 0, 2), (POT, 0, 4), (GROCERY, 6, 0), (GROCERY, 3, 0)]
    assert [acted[trial] for trial in TRIALS] == wanted


def test_rows_of_the_report_tell_scenes_of_other_things_apart():
    rows = [as_dict(trial, None) for trial in TRIALS]
    assert all(rows.count(row) == 1 for row in rows)
