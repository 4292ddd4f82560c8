from dataclasses import replace

import pytest

from imop.errors import CorruptData
from imop.evaluation.episodes import Episode, EpisodeLog, method_state
from imop.evaluation.trials import Trial

POT = "tabletop/lid_off_pot"
TRIAL = Trial(POT, 3, 1, 2)


def test_what_was_added_is_found_again(tmp_path):
    path = tmp_path / "new" / "episodes.jsonl"
    episode = Episode(TRIAL, "replay", "s", False, "task not done", 4)
    EpisodeLog(path).add(episode)
    again = EpisodeLog(path)
    assert again.find(TRIAL, "replay", "s") == episode
    assert again.find(TRIAL, "replay", "other code") is None
    assert again.find(Trial(TRIAL.task, 4, 1, 2), "replay", "s") is None
    assert again.find(replace(TRIAL, change="light"), "replay", "s") is None


def test_scenes_that_were_changed_are_told_from_others_and_older_lines_are_read(tmp_path):
    path = tmp_path / "episodes.jsonl"
    changed = Episode(replace(TRIAL, change="light,d415"), "replay", "s", True, "success", 3)
    EpisodeLog(path).add(changed)
    path.write_text(path.read_text() + path.read_text().replace(', "change": "light,d415"', ""))
    log = EpisodeLog(path)
    assert log.find(replace(TRIAL, change="d415,light"), "replay", "s") == changed
    assert log.find(TRIAL, "replay", "s") == replace(changed, trial=TRIAL)


def test_a_line_that_was_cut_off_is_tried_again_and_the_others_stay(tmp_path):
    path = tmp_path / "episodes.jsonl"
    first, second = (Episode(TRIAL, m, "s", True, "success", 3) for m in ("replay", "oracle"))
    log = EpisodeLog(path)
    log.add(first)
    log.add(second)
    path.write_bytes(path.read_bytes()[:-7])
    cut = EpisodeLog(path)
    assert cut.find(TRIAL, "replay", "s") == first and cut.find(TRIAL, "oracle", "s") is None
    cut.add(second)
    assert EpisodeLog(path).find(TRIAL, "oracle", "s") == second


@pytest.mark.parametrize("line", ["{", "[]", '{"trial": 1}', "null"])
def test_a_damaged_line_is_named(tmp_path, line):
    path = tmp_path / "episodes.jsonl"
    EpisodeLog(path).add(Episode(TRIAL, "replay", "s", None, "no room"))
    path.write_text(line + "\n" + path.read_text())
    with pytest.raises(CorruptData, match="line 1"):
        EpisodeLog(path)


def test_weights_count_only_for_methods_that_have_some(tmp_path):
    (tmp_path / "weights.safetensors").write_bytes(b"others")
    assert method_state("learned", None, POT) != method_state("learned", tmp_path, POT)
    assert method_state("registration", None, POT) != method_state("registration", tmp_path, POT)
    assert method_state("textbook", None, POT) == method_state("textbook", tmp_path, POT)
    assert method_state("expert", None, POT) != method_state("textbook", None, POT)


def test_the_states_of_our_own_tasks_need_no_further_digest():
    assert method_state("expert", None, POT).count("-") == 0
    assert method_state("learned", None, POT).count("-") == 2
