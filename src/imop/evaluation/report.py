"""Success counts to results.json, report.md and a table on the terminal."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from imop.evaluation.config import Instances
from imop.evaluation.statistics import wilson
from imop.files import replaced


@dataclass(frozen=True)
class Count:
    """Successes among trials."""

    successes: int
    trials: int

    @property
    def rate(self) -> float:
        """Fraction of successes; 0 without trials."""
        return self.successes / self.trials if self.trials else 0.0

    def __str__(self) -> str:
        low, high = wilson(self.successes, self.trials)
        return f"{100 * self.rate:.0f} % [{100 * low:.0f}, {100 * high:.0f}]"


@dataclass(frozen=True)
class Results:
    """Counts of every method on every task of a suite, on the same scenes.

    Attributes:
        suite: name of the suite.
        split: which of its tasks.
        seed: first seed of the scenes.
        counts: method -> task -> count.
        notes: what a reader must know to compare the numbers, one sentence each.
        change: what the scenes differed in from the demonstrated ones; nothing but poses if empty.
        instances: whether the scenes showed the demonstrated objects or others of their kind.
        disturb: what went wrong once in every episode; nothing if empty.
    """

    suite: str
    split: str
    seed: int
    counts: Mapping[str, Mapping[str, Count]]
    notes: tuple[str, ...] = ()
    change: str = ""
    instances: Instances = "same"
    disturb: str = ""

    def average(self, method: str) -> float:
        """Mean of the tasks' success rates."""
        rates = [count.rate for count in self.counts[method].values()]
        return sum(rates) / len(rates)

    def as_dict(self) -> dict[str, Any]:
        """The layout of results.json, the same for every benchmark that counts successes."""
        methods = {
            name: {
                "average": self.average(name),
                "tasks": {
                    task: {"successes": count.successes, "trials": count.trials}
                    for task, count in tasks.items()
                },
            }
            for name, tasks in self.counts.items()
        }
        head = {"suite": self.suite, "split": self.split, "seed": self.seed, "change": self.change}
        return {**head, "instances": self.instances, "disturb": self.disturb, "methods": methods}

    def rows(self) -> list[list[str]]:
        """Header and one row per task, then the average."""
        methods = list(self.counts)
        tasks = list(next(iter(self.counts.values())))
        rows = [["task", *methods]]
        rows += [[task, *(str(self.counts[m][task]) for m in methods)] for task in tasks]
        rows.append(["average", *(f"{100 * self.average(m):.1f} %" for m in methods)])
        return rows

    @property
    def _changed(self) -> str:
        other = ", other instances" if self.instances == "other" else ""
        changed = f", changed: {self.change}" if self.change else ""
        return other + changed + (f", disturbed: {self.disturb}" if self.disturb else "")

    def markdown(self) -> str:
        """The table with its conditions, as Markdown."""
        header, *body = self.rows()
        lines = [
            f"# {self.suite}, {self.split} tasks, scenes from seed {self.seed}{self._changed}",
            "",
            "Success rates with 95 % Wilson intervals; every method saw the same demonstrations and scenes.",
            "",
            *markdown_table(header, body),
            "",
            *(f"- {note}" for note in self.notes),
        ]
        return "\n".join(lines) + "\n"

    def table(self) -> Table:
        """The table for the terminal."""
        header, *body = self.rows()
        table = Table(title=f"{self.suite}, {self.split}, seed {self.seed}{self._changed}")
        for name in header:
            table.add_column(name)
        for row in body:
            table.add_row(*row)
        return table

    def save(self, folder: Path) -> None:
        """Write results.json and report.md into `folder`."""
        save_json(self.as_dict(), folder / "results.json")
        with replaced(folder / "report.md") as temporary:
            temporary.write_text(self.markdown())


def save_json(value: Any, path: Path) -> None:
    """Write `value` as indented JSON, whole or not at all."""
    with replaced(path) as temporary:
        temporary.write_text(json.dumps(value, indent=2) + "\n")


def markdown_table(header: Sequence[str], body: Iterable[Sequence[str]]) -> list[str]:
    """The lines of a table."""
    rule = "|" + "---|" * len(header)
    return [f"| {' | '.join(header)} |", rule, *(f"| {' | '.join(row)} |" for row in body)]


def console_for_tables() -> Console:
    """Standard output; a pipe has no width of its own and gets one that the tables fit into."""
    console = Console()
    return console if console.is_terminal else Console(width=150)
