"""The command: what it lists, writes and refuses."""

import pytest

from imop.cli import main
from imop.evaluation import benchmark
from imop.evaluation.episodes import Episode, EpisodeLog, method_state
from imop.reproduce import tables
from imop.reproduce.run import LOG, Options, why_not
from imop.reproduce.tables import TABLES
from tests.reproduce.tables import SECTION, TABLE

DOCUMENT = "before\n<!-- reproduce:small -->\n<!-- end -->\nafter\n"


def imop(*arguments):
    with pytest.raises(SystemExit) as done:
        main([str(argument) for argument in arguments])
    return done.value.code


@pytest.fixture
def small(tmp_path, monkeypatch):
    """The command knows one small table, all episodes of which are in the log; the folder of its results."""
    monkeypatch.setattr(tables, "TABLES", {"small": TABLE})
    monkeypatch.setattr(benchmark, "attempt", None)
    log = EpisodeLog(tmp_path / LOG)
    for of_task in SECTION.trials(4, 20).values():
        for trial in of_task:
            for method in ("learned", "replay"):
                state = method_state(method, None, trial.task)
                log.add(Episode(trial, method, state, method == "learned", "reason"))
    return tmp_path


def test_a_table_is_printed_kept_and_written_into_its_section(small, capsys):
    document = small / "results.md"
    document.write_text(DOCUMENT)
    arguments = ("reproduce", "small", "--seed", 20, "--out", small)
    assert imop(*arguments, "--write-docs", document) == 0
    out = capsys.readouterr().out
    assert "learned" in out and "100.0 [88, 100]" in out and "no such" not in out
    assert {path.name for path in (small / "small").iterdir()} == {"results.json", "table.md", "tasks.png"}
    written = document.read_text()
    assert "| learned | 100.0 [88, 100]" in written and written.startswith("before") and "after" in written
    # Without a table, sections are written from what was kept.
    document.write_text(DOCUMENT)
    assert imop("reproduce", "--out", small, "--write-docs", document) == 0
    assert document.read_text() == written


def test_the_quick_table_says_that_it_agrees_with_the_whole_one(small, capsys):
    arguments = ("reproduce", "small", "--seed", 20, "--out", small)
    assert imop(*arguments) == 0 and imop(*arguments, "--quick") == 0
    assert "in the whole table on these tasks: agrees" in " ".join(capsys.readouterr().out.split())
    assert (small / "small" / "quick" / "results.json").exists()


def test_without_a_table_those_that_there_are_are_listed(small, capsys):
    assert imop("reproduce", "--out", small) == 0
    out = capsys.readouterr().out
    assert "small" in out and "2 of 4 there" in out and "112" in out  # 7 tasks, 4 scenes, 4 rows


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("none",), "table: none"),
        (("small", "--quick", "--write-docs", "x.md"), "write-docs"),
        (("small", "--episodes", 0), "episodes"),
        (("--write-docs", "no/such.md"), "no/such.md"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(small, capsys, arguments, said):
    assert imop("reproduce", *arguments, "--out", small) == 2
    assert said in capsys.readouterr().err


def test_every_table_has_a_section_in_the_documents(pytestconfig):
    text = (pytestconfig.rootpath / "docs" / "results.md").read_text()
    for name in TABLES:
        assert text.count(f"<!-- reproduce:{name} -->") == 1


def test_methods_that_there_are_can_be_tried():
    assert why_not(tables.LEARNED) == "" and Options().command(TABLE) == "imop reproduce small"
