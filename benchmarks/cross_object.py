"""Shown with one grocery, tried with another: success of a method for every pair of the nine groceries.

Rows are what was shown, columns what was tried. The cupboard's width and colours differ. Every episode is
kept in episodes.jsonl: run again, the same command goes on where it was stopped, and what was tried with
other code or weights is tried again.

    python benchmarks/cross_object.py --method registration --out runs/cross_object
"""

import shlex
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro
from rich.console import Console
from rich.table import Table

from imop.errors import ImopError, InvalidInput
from imop.evaluation.benchmark import count_of, tried
from imop.evaluation.episodes import Episode
from imop.evaluation.report import console_for_tables, markdown_table, save_json
from imop.evaluation.statistics import wilson
from imop.evaluation.trials import Trial
from imop.files import replaced, writable_folder
from imop.sim.parts.grocery import GROCERIES

TASK = "tabletop/grocery_in_cupboard"
NAMES = [kind.name for kind in GROCERIES]

Cells = Mapping[tuple[str, str], Sequence[Episode]]
"""Episodes by what was shown and what was tried."""


@dataclass
class Options:
    """Settings of the benchmark.

    Attributes:
        method: any that `imop eval --methods` knows, or one's own.
        weights: of the learned policy; by default the bundled ones.
        groceries: comma-separated names; all nine by default.
        trials: scenes per cell.
        focus: whether somebody points at the grocery, in demonstration and scene, until it is grasped.
        diagonal: only the cells where the same grocery is shown and tried.
        first: seed of the first scene.
        out: folder of results.json, report.md and episodes.jsonl.
        jobs: processes.
    """

    method: str = "learned"
    weights: Path | None = None
    groceries: str = ",".join(NAMES)
    trials: int = 10
    focus: bool = False
    diagonal: bool = False
    first: int = 0
    out: Path = Path("runs/cross_object")
    jobs: int = 2


def chosen(options: Options) -> list[str]:
    """The groceries, in the order of the suite.

    Raises:
        InvalidInput: for an unknown one, or no scenes.
    """
    if options.trials < 1:
        raise InvalidInput("trials", f"{options.trials}", "at least 1")
    wanted = options.groceries.split(",")
    if unknown := [name for name in wanted if name not in NAMES]:
        raise InvalidInput("groceries", f"{unknown[0]!r}", f"any of {', '.join(NAMES)}")
    return [name for name in NAMES if name in wanted]


def measure(options: Options, console: Console) -> Cells:
    """All episodes of all cells.

    Raises:
        ImopError: as `tried`.
    """
    names = chosen(options)
    cells = [(a, b) for a in names for b in names if a == b or not options.diagonal]
    seeds = range(options.first, options.first + options.trials)
    trials = {
        (a, b): [Trial(TASK, seed, NAMES.index(b), shown_variation=NAMES.index(a)) for seed in seeds]
        for a, b in cells
    }
    everything = [trial for of_cell in trials.values() for trial in of_cell]
    log, method = options.out / "episodes.jsonl", options.method
    found = tried(everything, [method], options.jobs, console, log, options.weights, options.focus)
    return {cell: [found[trial, method] for trial in of_cell] for cell, of_cell in trials.items()}


def together(episodes: Sequence[Episode]) -> dict[str, Any]:
    """Counts of some episodes; errors are among the failures, and without a scene nothing was tried."""
    count = count_of(episodes)
    return {
        "successes": count.successes,
        "trials": count.trials,
        "rate": count.rate,
        "interval": wilson(count.successes, count.trials),
        "errors": sum(episode.error for episode in episodes),
        "without_scene": len(episodes) - count.trials,
    }


def parts(cells: Cells) -> dict[str, list[Episode]]:
    """The diagonal and what is off it."""
    split: dict[str, list[Episode]] = {}
    for (a, b), episodes in cells.items():
        split.setdefault("same grocery" if a == b else "another grocery", []).extend(episodes)
    return split


def shown_of(cells: Cells) -> list[str]:
    return list(dict.fromkeys(a for a, _ in cells))


def as_dict(cells: Cells) -> dict[str, Any]:
    """The layout of results.json, but for how it was made: a row of the matrix for each grocery shown."""
    names = shown_of(cells)
    summaries = {cell: together(episodes) for cell, episodes in cells.items()}
    return {
        "groceries": names,
        "matrix": [[summaries.get((a, b)) for b in names] for a in names],
        **{part.replace(" ", "_"): together(episodes) for part, episodes in parts(cells).items()},
        "errors": [
            {"shown": a, "tried": b, "seed": episode.trial.seed, "reason": episode.reason}
            for (a, b), episodes in cells.items()
            for episode in episodes
            if episode.error
        ],
    }


def rows(cells: Cells) -> list[list[str]]:
    """Header and a row for each grocery that was shown."""
    names = shown_of(cells)
    return [["shown", *names]] + [[a, *(written(cells.get((a, b), ())) for b in names)] for a in names]


def written(episodes: Sequence[Episode]) -> str:
    """A cell, such as "7 of 10 (1 error)"; empty if nothing was tried."""
    counts = together(episodes)
    errors = f" ({counts['errors']} error{'s' * (counts['errors'] > 1)})" if counts["errors"] else ""
    return f"{counts['successes']} of {counts['trials']}{errors}" if episodes else ""


def averages(cells: Cells) -> list[str]:
    """Success on the diagonal and off it, one sentence each."""
    return [f"{part}: {count_of(episodes)} ({written(episodes)})" for part, episodes in parts(cells).items()]


def markdown(cells: Cells, method: str) -> str:
    header, *body = rows(cells)
    lines = [
        f"# {method}: shown with one grocery (rows), tried with another (columns)",
        "",
        "Successes; an error is something that the method could not handle, and counts as a failure.",
        "",
        *markdown_table(header, body),
        "",
        *(f"- {sentence}" for sentence in averages(cells)),
        "",
        "Shares with 95 % Wilson intervals.",
    ]
    return "\n".join(lines) + "\n"


def show(cells: Cells, method: str, console: Console) -> None:
    header, *body = rows(cells)
    table = Table(*header, title=f"{method}: successes, shown (rows) and tried (columns)")
    for row in body:
        table.add_row(*row)
    console.print(table)
    for sentence in averages(cells):
        console.print(sentence, markup=False, highlight=False)


def main() -> int:
    options = tyro.cli(Options, description=__doc__)
    console = console_for_tables()
    try:
        writable_folder(options.out)
        cells = measure(options, console)
    except ImopError as error:
        console.print(f"[red]{error}")
        return 2
    show(cells, options.method, console)
    how = {"command": shlex.join(["python", *sys.argv]), "method": options.method}
    save_json({**how, **as_dict(cells)}, options.out / "results.json")
    with replaced(options.out / "report.md") as temporary:
        temporary.write_text(markdown(cells, options.method))
    console.print(f"written: {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
