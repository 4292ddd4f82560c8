"""What follows from outcomes, against counting by hand; what is kept in a file."""

from dataclasses import replace

import pytest

from imop.errors import CorruptData
from imop.evaluation.report import Count
from imop.evaluation.statistics import wilson
from imop.reproduce.measured import (
    Measured,
    MeasuredSection,
    agreement,
    assemble,
    compare,
    load_measured,
    on_these,
    ranks_on_these,
)
from imop.reproduce.table import Row
from tests.reproduce.tables import ABSENT, LEARNED, PUBLISHED, REPLAY

A = {"one": [True, True, False, None], "two": [False, False, True, True]}
B = {"one": [True, False, False, True], "two": [False, False, False, True]}


def table(*rows, tasks=("one", "two"), quick=False):
    section = MeasuredSection("Section", tasks, (), rows, PUBLISHED)
    return Measured("small", "Small", "imop", "abc", "digest", "x", 20, 4, quick, (section,), ("Note.",))


def test_averages_are_means_over_tasks_and_scenes_that_were_not_there_do_not_count():
    (row,) = assemble((LEARNED,), {"learned": A}, {})
    assert row.counts == {"one": Count(2, 3), "two": Count(2, 4)}
    assert row.average == pytest.approx((2 / 3 + 2 / 4) / 2)
    assert row.interval == wilson(4, 7)
    assert row.rank is None and row.pairs is None  # there is nothing to compare with


def test_rows_are_compared_with_the_first_in_the_scenes_that_both_had():
    first, second = assemble((LEARNED, REPLAY), {"learned": A, "replay": B}, {})
    assert first.pairs is None and second.pairs is not None
    pairs = second.pairs
    assert (pairs.against, pairs.both, pairs.only_other, pairs.only_this) == ("learned", 2, 2, 0)
    assert pairs.p == pytest.approx(0.5) and pairs.kept == Count(2, 4)
    assert (first.rank, second.rank) == (1.0, 2.0)
    mirrored = compare("replay", B, A)
    assert (mirrored.only_other, mirrored.only_this, mirrored.p) == (0, 2, pairs.p)


def test_a_row_may_be_compared_with_another_one_than_the_first():
    disturbed = Row("replay, moved", "replay", against="replay", disturb="moved")
    rows = assemble((LEARNED, REPLAY, disturbed), {"learned": A, "replay": B, "replay, moved": B}, {})
    assert rows[2].pairs is not None and rows[2].pairs.against == "replay"
    assert (rows[2].pairs.only_other, rows[2].pairs.only_this, rows[2].pairs.p) == (0, 0, 1.0)


def test_a_row_that_was_not_tried_says_why_and_changes_nothing_for_the_others():
    rows = assemble((LEARNED, ABSENT, REPLAY), {"learned": A, "replay": B}, {"elsewhere": "no weights"})
    assert rows[1].missing == "no weights" and rows[1].counts is None and rows[1].pairs is None
    alone = assemble((LEARNED, REPLAY), {"learned": A, "replay": B}, {})
    assert (rows[0], rows[2]) == alone


def test_a_row_with_other_tasks_has_no_rank_and_is_compared_on_those_it_shares():
    part = {"one": [True, True, True, True]}
    _, row = assemble((LEARNED, REPLAY), {"learned": A, "replay": part}, {})
    assert row.rank is None
    assert row.pairs is not None and (row.pairs.both, row.pairs.only_this) == (2, 1)


def test_published_rows_are_averaged_and_ranked_over_the_same_tasks():
    better, worse = PUBLISHED
    assert on_these(better, ["open_drawer"]) == 80 and on_these(better, ["open_drawer", "other"]) is None
    assert ranks_on_these(PUBLISHED, ["open_drawer", "stack_cubes"]) == {"better": 1.0, "worse": 2.0}
    assert ranks_on_these(PUBLISHED, ["other"]) == {}
    assert on_these(worse, []) is None


def test_a_table_comes_back_from_its_file(tmp_path):
    rows = assemble((LEARNED, REPLAY, ABSENT), {"learned": A, "replay": B}, {"elsewhere": "no weights"})
    measured = replace(table(*rows), columns=("kept", "parameters"))
    measured.save(tmp_path / "results.json")
    assert load_measured(tmp_path / "results.json") == measured


@pytest.mark.parametrize("text", ["", "{", "[]", '{"name": 1}'])
def test_what_is_no_table_is_refused(tmp_path, text):
    (tmp_path / "results.json").write_text(text)
    with pytest.raises(CorruptData, match="imop reproduce"):
        load_measured(tmp_path / "results.json")


def test_a_quick_table_agrees_with_itself_and_not_with_what_is_outside_of_its_interval():
    (row,) = assemble((LEARNED,), {"learned": A}, {})
    whole = replace(row, counts={"one": Count(0, 25), "two": Count(0, 25), "three": Count(25, 25)})
    (same,) = agreement(table(row, quick=True), table(row))
    (other,) = agreement(table(row, quick=True), table(whole))
    assert same.endswith("agrees") and other.endswith("DIFFERS") and "0 % in the whole table" in other
    assert agreement(table(row), table(replace(row, counts=None))) == []
