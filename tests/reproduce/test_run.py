"""Which scenes are tried, from a log that stands for having tried them."""

from dataclasses import replace

import pytest
from rich.console import Console

from imop.errors import CorruptData, InvalidInput
from imop.evaluation import benchmark
from imop.evaluation.episodes import Episode, EpisodeLog, method_state
from imop.evaluation.report import Count
from imop.reproduce import run
from imop.reproduce.run import LOG, Options, measure, not_measured, rows_of, trials_of
from imop.reproduce.table import Row, Section, SuiteSection
from imop.reproduce.tables import TABLES, find_table
from tests.reproduce.tables import LEARNED, REPLAY, SECTION, TABLE

QUIET = Console(quiet=True)


def never(*_):
    raise AssertionError("was tried though it is in the log")


@pytest.fixture
def logged(tmp_path, monkeypatch):
    """A log in which learned solves every second scene and replay all."""
    monkeypatch.setattr(benchmark, "attempt", never)
    monkeypatch.setattr(benchmark, "demonstrations_for", never)
    log = EpisodeLog(tmp_path / LOG)
    for of_task in SECTION.trials(4, 20).values():
        for trial in of_task:
            for row in (LEARNED, REPLAY):
                state = method_state(row.method, None, trial.task)
                solved = row is REPLAY or trial.seed % 2 == 0
                log.add(Episode(trial, row.method, state, solved, "reason"))
    return Options(tmp_path, seed=20, jobs=1)


def test_a_table_is_assembled_from_the_log_and_what_is_not_there_says_so(logged):
    measured = measure(TABLE, logged, QUIET)
    learned, replay, absent, unknown = measured.sections[0].rows
    assert learned.average == 0.5 and replay.average == 1.0
    assert set(learned.counts.values()) == {Count(2, 4)} and len(learned.counts) == 7
    assert (replay.pairs.only_other, replay.pairs.only_this) == (0, 14) and replay.pairs.p < 0.001
    assert absent.missing == "no weights in no/such/folder; make it so"
    assert "no_such_method" in unknown.missing
    assert (measured.seed, measured.episodes, measured.quick) == (20, 4, False)
    assert measured.command == "imop reproduce small --seed 20"


def test_rows_of_other_methods_are_taken_from_the_log_if_all_of_their_episodes_are_there(logged):
    whole, chosen = measure(TABLE, logged, QUIET), replace(logged, methods=("no_such_method",))
    assert measure(TABLE, chosen, QUIET).sections == whole.sections
    longer = measure(TABLE, replace(chosen, episodes=5), QUIET)
    assert [row.missing for row in longer.sections[0].rows[:2]] == ["left out by --methods"] * 2


def test_the_quick_table_is_made_of_scenes_of_the_whole_one(logged, monkeypatch):
    monkeypatch.setattr(run, "_QUICK_EPISODES", 36)  # three tasks of three scenes for four rows
    quick = measure(TABLE, replace(logged, quick=True), QUIET)
    whole = measure(TABLE, logged, QUIET)
    (part,), (section,) = quick.sections, whole.sections
    assert len(part.tasks) == 3 and set(part.tasks) < set(section.tasks)
    assert set(part.rows[0].counts.values()) == {Count(2, 3)}  # seeds 20, 21, 22


@pytest.mark.parametrize("table", TABLES.values(), ids=lambda table: table.name)
def test_quick_is_a_part_of_every_table_that_fits_into_its_time(table):
    # Scenes of RLBench need the user's files, and those of other splits may come later.
    sections = [s for s in table.sections if getattr(s, "suite", "") == "tabletop" and "Chain" not in s.title]
    options = Options(quick=True)
    tried = 0
    for section in sections:
        part, whole = trials_of(table, section, options), trials_of(table, section, Options())
        assert all(part[task] == whole[task][: len(part[task])] for task in part)
        assert set(rows_of(section, True)) <= set(section.rows)
        tried += sum(map(len, part.values())) * len(rows_of(section, True))
    assert tried <= run._QUICK_EPISODES


def test_a_task_without_a_demonstration_costs_only_the_rows_that_need_it(tmp_path, monkeypatch):
    def tried(trials, methods, *_, **__):
        if "learned" in methods:
            raise InvalidInput("demonstration", "none", "one")
        return {(t, m): Episode(t, m, "s", True, "r") for t in trials for m in methods}

    monkeypatch.setattr(run, "tried", tried)
    rows = (LEARNED, REPLAY)
    monkeypatch.setattr(run, "_together", lambda rows: [[row] for row in rows])
    table = replace(TABLE, sections=(replace(SECTION, rows=rows),))
    learned, other = measure(table, Options(tmp_path, seed=20), QUIET).sections[0].rows
    assert "none" in learned.missing and other.average == 1.0


def test_a_suite_that_is_not_there_is_said(tmp_path):
    section = replace(SECTION, split="no_such_split")
    (measured,) = measure(replace(TABLE, sections=(section,)), Options(tmp_path, seed=20), QUIET).sections
    assert all("no_such_split" in row.missing for row in measured.rows)
    assert measured.tasks == ("open_drawer", "stack_cubes")  # the published ones are left


def test_scenes_in_which_no_disturbance_happened_do_not_count(tmp_path, monkeypatch):
    def tried(trials, methods, *_, **__):
        return {
            (t, m): Episode(t, m, "s", True, "r", disturbed=t.seed % 2 == 0) for t in trials for m in methods
        }

    class Two(SuiteSection):
        def trials(self, episodes, seed):
            everything = super().trials(episodes, seed)
            return {task: everything[task] for task in ("open_drawer", "stack_cubes")}

    monkeypatch.setattr(run, "tried", tried)
    moved = Row("replay, moved", "replay", disturb="moved", demonstrations=3)
    table = replace(TABLE, sections=(Two("Two", (REPLAY, moved), suite="tabletop"),))
    (section,) = measure(table, Options(tmp_path, seed=20), QUIET).sections
    still, disturbed = section.rows
    assert set(still.counts.values()) == {Count(4, 4)} and set(disturbed.counts.values()) == {Count(2, 2)}
    assert disturbed.pairs.kept == Count(2 * len(disturbed.counts), 2 * len(disturbed.counts))


def test_a_row_changes_nothing_but_what_it_names_in_its_scenes():
    scenes = SECTION.trials(2, 20)
    three = Row("three", "learned", demonstrations=3).tried_in(scenes)
    assert LEARNED.tried_in(scenes) == scenes
    assert all(trial.demonstrations == 3 for of_task in three.values() for trial in of_task)
    usual = {task: [replace(trial, demonstrations=1) for trial in of_task] for task, of_task in three.items()}
    assert usual == scenes
    with pytest.raises(InvalidInput, match="disturb"):
        Row("none", "learned", disturb="by no one").tried_in(scenes)


@pytest.mark.parametrize(
    "wrong", [{"episodes": 0}, {"seed": -1}, {"seed": 999_999, "episodes": 2}, {"jobs": 0}]
)
def test_options_that_mean_nothing_are_refused(wrong):
    with pytest.raises(InvalidInput):
        Options(**wrong)


def test_a_method_that_the_table_does_not_have_is_refused(tmp_path):
    with pytest.raises(InvalidInput, match="lerned"):
        measure(TABLE, Options(tmp_path, methods=("lerned",)), QUIET)


def test_a_log_that_cannot_be_read_ends_the_command(tmp_path):
    (tmp_path / LOG).write_text("nonsense\n")
    with pytest.raises(CorruptData):
        measure(TABLE, Options(tmp_path, seed=20), QUIET)


def test_before_anything_is_measured_the_published_rows_are_there():
    for table in TABLES.values():
        blank = not_measured(table, Options())
        assert all(row.missing and row.counts is None for section in blank.sections for row in section.rows)
        assert [s.published for s in blank.sections] == [s.published for s in table.sections]


def test_an_unknown_table_is_refused_with_the_names_of_those_that_there_are():
    with pytest.raises(InvalidInput, match="cross-object"):
        find_table("none")


def test_labels_are_unique_and_rows_are_compared_with_one_before_them():
    for table in TABLES.values():
        for section in table.sections:
            labels = [row.label for row in section.rows]
            assert len(set(labels)) == len(labels)
            for k, row in enumerate(section.rows):
                assert row.against is None or row.against in labels[:k] or row.against == row.label


def test_published_sections_have_no_scenes():
    assert Section("Only published").trials(3, 20) == {}
