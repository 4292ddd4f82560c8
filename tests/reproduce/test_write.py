"""Tables as text, and sections of a document."""

import matplotlib.figure
import pytest
from matplotlib.container import BarContainer
from rich.console import Console

from imop.errors import CorruptData, InvalidInput, MissingExtra
from imop.reproduce import plot
from imop.reproduce.measured import assemble
from imop.reproduce.plot import save_plot
from imop.reproduce.write import (
    by_task,
    markdown,
    narrow,
    remarks,
    replace_section,
    summary,
    terminal_tables,
    write_section,
)
from tests.reproduce.tables import ABSENT, LEARNED, REPLAY
from tests.reproduce.test_measured import A, B, table

ROWS = assemble((LEARNED, REPLAY, ABSENT), {"learned": A, "replay": B}, {"elsewhere": "no weights; make it"})
DOCUMENT = (
    "# Title\n\n<!-- reproduce:small -->\nold\n<!-- end -->\n\nText\n<!-- reproduce:other -->\n<!-- end -->\n"
)


def test_every_row_has_as_many_cells_as_the_header():
    (section,) = table(*ROWS).sections
    for grid in (summary(section, ("kept", "parameters")), *by_task(section)):
        assert len({len(row) for row in grid}) == 1


def test_measured_and_published_numbers_stand_side_by_side():
    (section,) = table(*ROWS, tasks=("open_drawer", "stack_cubes")).sections
    head, learned, replay, absent, better, worse = summary(section)
    assert head[:2] == ["method", "mean of 2 tasks"]
    assert learned[1].startswith("58.3 [") and absent[1] == "not measured"
    cells = dict(zip(head, replay, strict=True))
    assert cells["compared with"] == "learned" and cells["only that / only this"] == "2 / 0"
    cells = dict(zip(head, better, strict=True))
    assert (cells["mean of 2 tasks"], cells["rank"]) == ("70.0", "1.0")
    assert cells["as published"] == "70.0, rank 1.0"
    assert worse[0] == "worse, published"


def test_a_mean_over_fewer_tasks_says_so():
    rows = assemble((LEARNED, REPLAY), {"learned": A, "replay": {"one": B["one"]}}, {})
    _, learned, replay, *_ = summary(table(*rows).sections[0])
    assert replay[1].endswith("of 1 tasks") and "tasks" not in learned[1]


def test_what_was_not_measured_is_said_with_what_would_help():
    text = markdown(table(*ROWS))
    assert "not measured: elsewhere (no weights; make it)." in text and "- Note." in text
    assert "commit abc" in text and "from seed 20" in text


def test_pairs_of_what_is_shown_and_tried_become_a_matrix():
    counts = {"soup -> tuna": [True, False], "tuna -> soup": [True, True]}
    rows = assemble((LEARNED,), {"learned": counts}, {})
    (matrix,) = by_task(table(*rows, tasks=tuple(counts)).sections[0])
    assert matrix == [
        ["learned: shown, then tried", "soup", "tuna"],
        ["soup", "-", "1/2"],
        ["tuna", "2/2", "-"],
    ]


def test_the_terminal_shows_the_same_cells():
    console = Console(width=200, record=True, quiet=False, file=open("/dev/null", "w"))  # noqa: SIM115
    for found in terminal_tables(table(*ROWS)):
        console.print(found)
    text = console.export_text()
    (section,) = table(*ROWS).sections
    assert all(cell in text for row in summary(section) for cell in row)


def test_a_wide_table_comes_in_parts_that_fit_and_lose_nothing():
    grid = [["task", *(f"method {n}, published" for n in range(12))]]
    grid += [[name, *(f"{n}.{n}" for n in range(12))] for name in ("open_drawer", "stack_cubes")]
    parts = narrow(grid)
    assert len(parts) > 1
    assert all(len("| " + " | ".join(row) + " |") <= 110 for part in parts for row in part)
    assert [sum((part[n][1:] for part in parts), grid[n][:1]) for n in range(3)] == grid
    assert narrow(grid, width=10_000) == [grid]


def test_a_column_wider_than_the_page_stands_alone():
    grid = [["task", "a" * 200, "b"], ["open_drawer", "1", "2"]]
    assert narrow(grid) == [[row[:2] for row in grid], [[row[0], row[2]] for row in grid]]


def test_a_section_is_replaced_and_the_rest_stays_and_writing_twice_changes_nothing():
    once = replace_section(DOCUMENT, "small", ["new"])
    assert once == DOCUMENT.replace("\nold\n", "\n\nnew\n\n")
    assert replace_section(once, "small", ["new"]) == once
    both = replace_section(replace_section(DOCUMENT, "other", ["x"]), "small", ["new"])
    assert both == replace_section(once, "other", ["x"])


@pytest.mark.parametrize("text", ["", "<!-- reproduce:small -->", DOCUMENT + DOCUMENT])
def test_a_document_without_the_section_or_with_two_is_refused(text):
    with pytest.raises(InvalidInput) as error:
        replace_section(text, "small", ["new"])
    assert error.value.field == "write-docs"


def test_a_document_gets_the_table(tmp_path):
    document = tmp_path / "results.md"
    document.write_text(DOCUMENT)
    write_section(document, table(*ROWS))
    text = document.read_text()
    assert "### Section" in text and "| learned |" in text and "old" not in text and "Text" in text
    with pytest.raises(CorruptData):
        write_section(tmp_path / "none.md", table(*ROWS))


def test_reasons_are_said_once_for_all_rows_that_share_them():
    rows = assemble((LEARNED, REPLAY), {}, {"learned": "no reason", "replay": "no reason"})
    assert remarks(table(*rows))[0] == "Section, not measured: learned; replay (no reason)."


def test_bars_have_the_heights_and_whiskers_of_the_rates(tmp_path, monkeypatch):
    figures = []
    figure = matplotlib.figure.Figure
    monkeypatch.setattr(
        "matplotlib.figure.Figure", lambda **how: figures.append(figure(**how)) or figures[-1]
    )
    assert save_plot(table(*ROWS), tmp_path / "tasks.png")
    assert (tmp_path / "tasks.png").read_bytes().startswith(b"\x89PNG")
    (axis,) = figures[0].axes
    bars = [found for found in axis.containers if isinstance(found, BarContainer)]
    heights = {found.get_label(): [bar.get_height() for bar in found] for found in bars}
    assert heights == {"learned": pytest.approx([200 / 3, 50]), "replay": pytest.approx([50, 25])}
    assert not save_plot(table(), tmp_path / "none.png")


def test_without_matplotlib_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "matplotlib.figure", None)
    with pytest.raises(MissingExtra, match="viz"):
        plot.save_plot(table(*ROWS), tmp_path / "tasks.png")
