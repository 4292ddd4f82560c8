"""`imop reproduce`: list the tables, measure one, or write what was measured into a document."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro
from tyro.conf import Positional

from imop.errors import InvalidInput, MissingExtra
from imop.files import writable_folder
from imop.terminal import console, list_folder, status

if TYPE_CHECKING:
    from imop.reproduce.measured import Measured
    from imop.reproduce.run import Options
    from imop.reproduce.table import Table


def reproduce(
    table: Positional[str | None] = None,
    quick: bool = False,
    episodes: int | None = None,
    seed: int = 7000,
    jobs: int = 2,
    methods: Annotated[str, tyro.conf.arg(metavar="NAME,NAME")] = "",
    out: Path = Path("runs/reproduce"),
    write_docs: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None,
) -> int:
    """Measure a table of the paper, or one of our own, with the published numbers beside.

    Without a table it lists them, with their cost. Rows whose method or weights are not there say so. Every
    episode is kept in OUT/episodes.jsonl and every demonstration in OUT/demonstrations, which all tables
    share: run again, the same command goes on where it was stopped. Writes table.md, results.json and, with
    the extra viz, tasks.png into OUT/TABLE.

    Args:
        table: base, novel, parameters, cross-object, ablations, real-robot, disturbed, demonstrations, long.
        quick: the first scenes of some of the tasks, within 20 minutes on two cores; into OUT/TABLE/quick.
            Says whether they agree with the whole table, if that was measured.
        episodes: scenes per task; 25 if not given, 10 for a pair of cross-object.
        seed: first seed of the scenes.
        jobs: parallel processes.
        methods: try only the rows of these; the others are printed as far as they were tried before.
        out: folder of all tables.
        write_docs: document whose section of the table is replaced, such as docs/results.md. Without a table
            all sections are, by what was measured before; nothing is measured then.
    """
    from imop.reproduce.run import Options
    from imop.reproduce.tables import find_table

    options = Options(out, quick, episodes, seed, jobs, tuple(methods.split(",")) if methods else ())
    if quick and write_docs is not None:
        raise InvalidInput("write-docs", "together with quick", "the whole table")
    if table is not None:
        return _measure(find_table(table), options, write_docs)
    return _list(options) if write_docs is None else _write_all(options, write_docs)


def _measure(table: "Table", options: "Options", document: Path | None) -> int:
    from imop.reproduce.run import measure
    from imop.reproduce.write import write_section

    folder = options.folder(table)
    writable_folder(folder)
    measured = measure(table, options, console)
    _print(measured)
    _save(measured, folder)
    if options.quick:
        _say_agreement(measured, options.out / table.name)
    if document is not None:
        write_section(document, measured)
        console.print(document)
    list_folder(folder)
    return 0


def _print(measured: "Measured") -> None:
    from imop.evaluation.report import console_for_tables
    from imop.reproduce.write import origin, remarks, terminal_tables

    for found in terminal_tables(measured):
        console_for_tables().print(found)
    console.print(origin(measured))
    for remark in remarks(measured):
        console.print(f"- {remark}")


def _save(measured: "Measured", folder: Path) -> None:
    from imop.files import replaced
    from imop.reproduce.plot import save_plot
    from imop.reproduce.write import markdown

    measured.save(folder / "results.json")
    with replaced(folder / "table.md") as temporary:
        temporary.write_text(markdown(measured))
    try:
        save_plot(measured, folder / "tasks.png")
    except MissingExtra as error:
        console.print(f"no tasks.png: {error}")


def _say_agreement(quick: "Measured", folder: Path) -> None:
    from imop.reproduce.measured import agreement, load_measured

    whole = folder / "results.json"
    if whole.is_file():
        for sentence in agreement(quick, load_measured(whole)):
            console.print(sentence)


def _write_all(options: "Options", document: Path) -> int:
    from imop.reproduce.measured import load_measured
    from imop.reproduce.run import not_measured
    from imop.reproduce.tables import TABLES
    from imop.reproduce.write import write_section

    for table in TABLES.values():
        results = options.folder(table) / "results.json"
        measured = load_measured(results) if results.is_file() else not_measured(table, options)
        write_section(document, measured)
        console.print(f"{table.name}: {results if results.is_file() else 'not measured yet'}")
    console.print(document)
    return 0


def _list(options: "Options") -> int:
    from imop.evaluation.report import console_for_tables
    from imop.reproduce.cost import costs_table

    with status("counting"):
        costs = costs_table(options)
    console_for_tables().print(costs)
    return 0
