"""A measured table as Markdown, on the terminal, and as a section of a document."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from textwrap import wrap

from rich.table import Table as TerminalTable

from imop.errors import CorruptData, InvalidInput
from imop.evaluation.report import Count, markdown_table
from imop.files import read, replaced
from imop.reproduce.measured import (
    NOT_YET,
    Measured,
    MeasuredRow,
    MeasuredSection,
    Pairs,
    on_these,
    ranks_on_these,
)
from imop.reproduce.published import Published
from imop.reproduce.table import ARROW

Grid = list[list[str]]
"""Header and rows of cells."""

WIDTH = 110
"""Characters in a line of a document."""
_NOTHING = "-"
_END = "<!-- end -->"


def markdown(measured: Measured) -> str:
    """The whole table, the content of table.md."""
    return "\n".join([f"# {measured.title}", "", *_body(measured, "##")]) + "\n"


def replace_section(text: str, name: str, body: Sequence[str]) -> str:
    """A document with another body between `<!-- reproduce:NAME -->` and `<!-- end -->`.

    Raises:
        InvalidInput: if the document does not have that section exactly once.
    """
    begin = f"<!-- reproduce:{name} -->"
    before, found, rest = text.partition(begin)
    _, ended, after = rest.partition(_END)
    if not found or not ended or begin in rest:
        raise InvalidInput("write-docs", f"no section {begin} ... {_END}", "a file that has it once")
    return f"{before}{begin}\n\n" + "\n".join(body) + f"\n\n{_END}{after}"


def write_section(document: Path, measured: Measured) -> None:
    """Put the table into its section of a document, see `replace_section`.

    Raises:
        InvalidInput: if the document has no such section.
        CorruptData: if it cannot be read.
    """
    try:
        text = read(document, "name a document with sections").decode()
    except UnicodeDecodeError as error:
        raise CorruptData(document, "is no text", "name a document with sections") from error
    changed = replace_section(text, measured.name, _body(measured, "###"))
    with replaced(document) as temporary:
        temporary.write_text(changed)


def terminal_tables(measured: Measured) -> Iterator[TerminalTable]:
    """Summary and tasks of each section."""
    for section in measured.sections:
        for head, *rows in grids(section, measured.columns):
            table = TerminalTable(*head, title=section.title)
            for row in rows:
                table.add_row(*row)
            yield table


def remarks(measured: Measured) -> list[str]:
    """What a reader must know: what was not measured, which tasks are not there, and the table's notes."""
    lines = []
    for section in measured.sections:
        reasons: dict[str, list[str]] = {}
        for row in section.rows:
            if row.missing not in ("", NOT_YET):
                reasons.setdefault(row.missing, []).append(row.label)
        for reason, labels in reasons.items():
            lines.append(f"{section.title}, not measured: {'; '.join(labels)} ({reason}).")
        if section.absent:
            lines.append(f"{section.title}, no model files here: {', '.join(section.absent)}.")
    return [*dict.fromkeys(lines), *measured.notes]


def _body(measured: Measured, heading: str) -> list[str]:
    lines = [f"    {measured.command}", "", *wrap(origin(measured), WIDTH)]
    for section in measured.sections:
        lines += ["", f"{heading} {section.title}"]
        if section.rows and all(row.missing == NOT_YET for row in section.rows):
            lines += ["", *wrap(f"Not measured yet: {'; '.join(row.label for row in section.rows)}.", WIDTH)]
            section = replace(section, rows=())
        for grid in grids(section, measured.columns):
            for head, *rows in narrow(grid):
                lines += ["", *markdown_table(head, rows)]
    return [*lines, "", *(line for remark in remarks(measured) for line in _item(remark))]


def narrow(grid: Grid, width: int = WIDTH) -> list[Grid]:
    """The same table in as few parts as fit into `width`, each with the first column; no column is split."""
    first, *others = (list(column) for column in zip(*grid, strict=True))
    parts = [[first]]
    for column in others:
        part = [*parts[-1], column]
        if len(parts[-1]) > 1 and max(_written(row) for row in zip(*part, strict=True)) > width:
            part = [first, column]
            parts.append(part)
        parts[-1] = part
    return [[list(row) for row in zip(*part, strict=True)] for part in parts]


def _written(row: Sequence[str]) -> int:
    """Characters of a row of `markdown_table`."""
    return sum(len(cell) + 3 for cell in row) + 1


def _item(sentence: str) -> list[str]:
    return wrap(
        f"- {sentence}", WIDTH, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False
    )


def origin(measured: Measured) -> str:
    """What it was made with, in one sentence."""
    if not any(row.counts for section in measured.sections for row in section.rows):
        return "Nothing is measured yet."
    commit = f"commit {measured.commit}, " if measured.commit else ""
    scenes = f"{measured.episodes} scenes a task from seed {measured.seed}"
    part = "the quick part of the table, " if measured.quick else ""
    said = f"{part}{scenes}, {commit}code {measured.code}, {measured.machine}"
    return f"{said[0].upper()}{said[1:]}. Percent, with 95 % Wilson intervals."


def grids(section: MeasuredSection, columns: Sequence[str] = ()) -> list[Grid]:
    """What is printed of a section: methods, then tasks."""
    methods = summary(section, columns)
    return [*([methods] if methods[1:] else []), *by_task(section)]


def summary(section: MeasuredSection, columns: Sequence[str] = ()) -> Grid:
    """One row a method: success and rank over the same tasks, what the paper prints, and the comparison."""
    extra = {"kept": "kept of what the other solves", "parameters": "parameters"}
    has = {
        "rank": any(row.rank is not None for row in section.rows),
        "published": any(row.average is not None for row in section.published),
        "pairs": any(row.pairs for row in section.rows),
    }
    tasks = len(section.tasks)
    head = ["method", f"mean of {tasks} tasks" if tasks else "mean"]
    head += ["rank"] * (has["rank"] or bool(_published_ranks(section)))
    head += ["as published"] * has["published"]
    head += ["compared with", "only that / only this", "p"] * has["pairs"]
    head += [extra[column] for column in columns]
    rows = [_cells_of_measured(row, tasks, head) for row in section.rows]
    rows += [_cells_of_published(row, section, head) for row in section.published]
    return [head, *rows]


def _cells_of_measured(row: MeasuredRow, tasks: int, head: Sequence[str]) -> list[str]:
    pairs = row.pairs
    cells = {
        "rank": _number(row.rank),
        "compared with": pairs.against if pairs else _NOTHING,
        "only that / only this": f"{pairs.only_other} / {pairs.only_this}" if pairs else _NOTHING,
        "p": _p(pairs) if pairs else _NOTHING,
        "kept of what the other solves": str(pairs.kept) if pairs else _NOTHING,
        "parameters": _NOTHING if row.parameters is None else f"{row.parameters / 1e6:.2f} M",
    }
    average = _average(row, tasks) if row.counts else "not measured"
    return [row.label, average, *(cells.get(name, _NOTHING) for name in head[2:])]


def _cells_of_published(row: Published, section: MeasuredSection, head: Sequence[str]) -> list[str]:
    rank = "" if row.rank is None else f", rank {_number(row.rank)}"
    cells = {
        "rank": _number(_published_ranks(section).get(row.label)),
        "as published": _NOTHING if row.average is None else f"{row.average:.1f}{rank}",
        "parameters": _NOTHING if row.parameters is None else f"{row.parameters:g} M",
    }
    average = _number(on_these(row, section.tasks))
    return [published_label(row), average, *(cells.get(name, _NOTHING) for name in head[2:])]


def _published_ranks(section: MeasuredSection) -> dict[str, float]:
    return ranks_on_these(section.published, section.tasks)


def by_task(section: MeasuredSection) -> list[Grid]:
    """One row a task, one column a method; of pairs "shown -> tried" a matrix for each method."""
    measured = [row for row in section.rows if row.counts]
    if measured and all(ARROW in task for task in section.tasks):
        return [_matrix(row, section.tasks) for row in measured]
    published = [row for row in section.published if row.tasks]
    if not measured and not published:
        return []
    head = ["task", *(row.label for row in measured), *(published_label(row) for row in published)]
    rows = []
    for task in section.tasks:
        counts = [row.counts.get(task) if row.counts else None for row in measured]
        rates = [row.tasks.get(task) for row in published]
        rows.append([task, *map(_count, counts), *(_NOTHING if r is None else f"{r:g}" for r in rates)])
    return [[head, *rows]]


def _matrix(row: MeasuredRow, pairs: Sequence[str]) -> Grid:
    shown = list(dict.fromkeys(pair.split(ARROW)[0] for pair in pairs))
    tried = sorted({pair.split(ARROW)[1] for pair in pairs}, key=lambda name: (name not in shown, name))
    counts = row.counts or {}
    cells = [[_fraction(counts.get(a + ARROW + b)) for b in tried] for a in shown]
    head = [f"{row.label}: shown, then tried", *tried]
    return [head, *([a, *line] for a, line in zip(shown, cells, strict=True))]


def _fraction(count: Count | None) -> str:
    return _NOTHING if count is None else f"{count.successes}/{count.trials}"


def published_label(row: Published) -> str:
    """What a row of the paper is called beside ours."""
    return f"{row.label}, published"


def _count(count: Count | None) -> str:
    return _NOTHING if count is None or not count.trials else str(count).replace(" %", "", 1)


def _average(row: MeasuredRow, tasks: int) -> str:
    assert row.average is not None and row.interval is not None
    low, high = row.interval
    own = sum(count.trials > 0 for count in (row.counts or {}).values())
    return f"{100 * row.average:.1f} [{100 * low:.0f}, {100 * high:.0f}]" + f" of {own} tasks" * (own < tasks)


def _number(value: float | None) -> str:
    return _NOTHING if value is None else f"{value:.1f}"


def _p(pairs: Pairs) -> str:
    return "< 0.001" if pairs.p < 0.001 else f"{pairs.p:.2g}"
