"""How long the tables take."""

from dataclasses import replace

from rich.table import Table as TerminalTable

from imop.errors import ImopError
from imop.reproduce import tables
from imop.reproduce.run import Options, rows_of, trials_of, why_not
from imop.reproduce.table import Table

SECONDS = 9.0
"""Of one core for an episode with its share of the demonstrations: base tasks, seeds 20 and 21."""


def episodes_of(table: Table, options: Options) -> int:
    """How many episodes all of its rows take, those included that cannot be tried yet."""
    total = 0
    for section in table.sections:
        try:
            scenes = sum(map(len, trials_of(table, section, options).values()))
        except ImopError:
            scenes = 0
        total += scenes * len(rows_of(section, options.quick))
    return total


def costs_table(options: Options) -> TerminalTable:
    """Every table with its rows and its cost, as a whole and quick."""
    head = ("table", "", "rows", "episodes", "core hours", "quick: episodes", "minutes")
    found = TerminalTable(*head, caption="Tables share episodes, and what was tried is not tried again.")
    for table in tables.TABLES.values():
        rows = {row for section in table.sections for row in section.rows}
        there = sum(not why_not(row) for row in rows)
        whole, quick = (episodes_of(table, replace(options, quick=quick)) for quick in (False, True))
        hours, minutes = whole * SECONDS / 3600, quick * SECONDS / 60 / max(1, options.jobs)
        cells = (f"{there} of {len(rows)} there", whole, f"{hours:.1f}", quick, f"{minutes:.0f}")
        found.add_row(table.name, table.title, *map(str, cells))
    return found
