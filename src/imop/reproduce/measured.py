"""What was measured for a table, as results.json keeps it."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import dacite

from imop.errors import CorruptData
from imop.evaluation.report import Count, save_json
from imop.evaluation.statistics import average_ranks, mcnemar, wilson
from imop.files import read
from imop.reproduce.published import Published
from imop.reproduce.table import Column, Row

Outcomes = Mapping[str, Sequence[bool | None]]
"""Whether each scene of each task was solved; None where there was no scene."""
NOT_YET = "not yet"
"""Why a row has no numbers in a table that nobody has measured."""


@dataclass(frozen=True)
class Pairs:
    """Two rows in the same scenes.

    Attributes:
        against: label of the other row.
        both: scenes that both solve.
        only_other: scenes that only the other row solves.
        only_this: scenes that only this row solves.
        p: of McNemar's exact test, two-sided.
    """

    against: str
    both: int
    only_other: int
    only_this: int
    p: float

    @property
    def kept(self) -> Count:
        """Those solved among the scenes that the other row solves."""
        return Count(self.both, self.both + self.only_other)


@dataclass(frozen=True)
class MeasuredRow:
    """How a row did in a section.

    Attributes:
        label: of the row.
        method: its name.
        weights: folder, or empty for the bundled ones.
        missing: why nothing was measured; empty if it was.
        counts: task -> successes among scenes.
        average: mean of the tasks' rates, 0 to 1.
        interval: 95 %, Wilson's over all scenes.
        rank: mean rank among the measured rows of the section.
        pairs: the comparison with another row of the section.
        parameters: of the networks.
    """

    label: str
    method: str
    weights: str = ""
    missing: str = ""
    counts: Mapping[str, Count] | None = None
    average: float | None = None
    interval: tuple[float, float] | None = None
    rank: float | None = None
    pairs: Pairs | None = None
    parameters: int | None = None


@dataclass(frozen=True)
class MeasuredSection:
    """A section with its rows.

    Attributes:
        title: of the section.
        tasks: which were tried, or would be; of a published section those of the paper.
        absent: tasks that cannot be tried because their files are not there.
        rows: in the table's order.
        published: rows of the paper.
    """

    title: str
    tasks: tuple[str, ...]
    absent: tuple[str, ...]
    rows: tuple[MeasuredRow, ...]
    published: tuple[Published, ...]


@dataclass(frozen=True)
class Measured:
    """A table with everything that was measured.

    Attributes:
        name: of the table.
        title: above it.
        command: that made it.
        commit: of the checkout, or empty outside of one; with "+" if files differed from it.
        code: digest of imop's source.
        machine: processor and cores.
        seed: of the first scene.
        episodes: scenes of a task.
        quick: whether it is the quick part of the table.
        sections: its parts.
        notes: what a reader must know to compare the numbers.
        columns: see `Table`.
    """

    name: str
    title: str
    command: str
    commit: str
    code: str
    machine: str
    seed: int
    episodes: int
    quick: bool
    sections: tuple[MeasuredSection, ...]
    notes: tuple[str, ...]
    columns: tuple[Column, ...] = ()

    def save(self, path: Path) -> None:
        """Write it as JSON."""
        save_json(asdict(self), path)


def load_measured(path: Path) -> Measured:
    """What `Measured.save` wrote.

    Raises:
        CorruptData: if it cannot be read as that.
    """
    try:
        fields = json.loads(read(path))
        if not isinstance(fields, dict):
            raise TypeError("not an object")
        return dacite.from_dict(Measured, fields, dacite.Config(cast=[tuple], strict=True))
    except (ValueError, TypeError, dacite.DaciteError) as error:
        remedy = "make it again with `imop reproduce`"
        raise CorruptData(path, f"is no table of `imop reproduce` ({error})", remedy) from error


def assemble(
    rows: Sequence[Row], outcomes: Mapping[str, Outcomes], missing: Mapping[str, str]
) -> tuple[MeasuredRow, ...]:
    """The rows of a section with all that follows from the outcomes.

    Args:
        rows: of the section.
        outcomes: label -> what happened in the same scenes, for the rows that were tried.
        missing: label -> why it was not, for the others.
    """
    found = [_row(row, outcomes.get(row.label), missing.get(row.label, "")) for row in rows]
    found = [_compared(one, row, rows[0], outcomes) for one, row in zip(found, rows, strict=True)]
    return tuple(_ranked(found))


def counted(episodes: Sequence[bool | None]) -> Count:
    """Successes among the scenes that there were."""
    known = [success for success in episodes if success is not None]
    return Count(sum(known), len(known))


def agreement(quick: Measured, whole: Measured) -> list[str]:
    """Whether the rate of each row of the whole table, on the same tasks, lies in the quick one's interval.

    Args:
        quick: part of the table.
        whole: all of it.
    """
    rows = {(section.title, row.label): row for section in whole.sections for row in section.rows}
    sentences = []
    for section in quick.sections:
        for row in section.rows:
            full = rows.get((section.title, row.label))
            if row.counts is None or full is None or full.counts is None:
                continue
            shared = [task for task in row.counts if task in full.counts]
            here, there = (pooled([r.counts[task] for task in shared]) for r in (row, full) if r.counts)
            low, high = wilson(here.successes, here.trials)
            word = "agrees" if low <= there.rate <= high else "DIFFERS"
            rate = f"{100 * there.rate:.0f} % in the whole table"
            sentences.append(f"{section.title}, {row.label}: {here} here, {rate} on these tasks: {word}")
    return sentences


def pooled(counts: Iterable[Count]) -> Count:
    """All of them together."""
    these = list(counts)
    return Count(sum(count.successes for count in these), sum(count.trials for count in these))


def _row(row: Row, outcomes: Outcomes | None, missing: str) -> MeasuredRow:
    head = MeasuredRow(row.label, row.method, "" if row.weights is None else str(row.weights), missing)
    if outcomes is None:
        return head
    counts = {task: counted(episodes) for task, episodes in outcomes.items()}
    rates = [count.rate for count in counts.values() if count.trials]
    everything = pooled(counts.values())
    interval = wilson(everything.successes, everything.trials)
    average = sum(rates) / len(rates) if rates else 0.0
    return replace(head, counts=counts, average=average, interval=interval)


def _compared(measured: MeasuredRow, row: Row, first: Row, outcomes: Mapping[str, Outcomes]) -> MeasuredRow:
    other = row.against or first.label
    if other == row.label or row.label not in outcomes or other not in outcomes:
        return measured
    return replace(measured, pairs=compare(other, outcomes[other], outcomes[row.label]))


def compare(against: str, other: Outcomes, this: Outcomes) -> Pairs:
    """Two rows in the scenes that both were tried in; of a task that one does not have, nothing counts.

    Args:
        against: label of the other row.
        other: its outcomes.
        this: those of the row that is compared with it.
    """
    both = only_other = only_this = 0
    for task in other.keys() & this.keys():
        for a, b in zip(other[task], this[task], strict=True):
            if a is not None and b is not None:
                both += a and b
                only_other += a and not b
                only_this += b and not a
    return Pairs(against, both, only_other, only_this, mcnemar(only_other, only_this))


def _ranked(rows: Sequence[MeasuredRow]) -> list[MeasuredRow]:
    """With ranks among the rows that were tried on the same tasks as the first of them."""
    tried = [row for row in rows if row.counts]
    tasks = list(tried[0].counts or ()) if tried else []
    level = [row for row in tried if row.counts and list(row.counts) == tasks]
    if len(level) < 2:
        return list(rows)
    ranks = average_ranks([[row.counts[task].rate for task in tasks] for row in level if row.counts])
    of_label = {row.label: rank for row, rank in zip(level, ranks, strict=True)}
    return [replace(row, rank=of_label.get(row.label)) for row in rows]


def on_these(published: Published, tasks: Sequence[str]) -> float | None:
    """Mean of a published row over the tasks, percent; None if it lacks one."""
    rates: list[Any] = [published.tasks.get(task) for task in tasks]
    return sum(rates) / len(rates) if rates and None not in rates else None


def ranks_on_these(published: Sequence[Published], tasks: Sequence[str]) -> dict[str, float]:
    """Label -> mean rank among the published rows that have all of the tasks."""
    level = [row for row in published if on_these(row, tasks) is not None]
    if len(level) < 2:
        return {}
    ranks = average_ranks([[row.tasks[task] for task in tasks] for row in level])
    return {row.label: rank for row, rank in zip(level, ranks, strict=True)}
