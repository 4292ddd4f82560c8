"""Measures the rows of a table, as far as their methods and weights are there."""

import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

from rich.console import Console

from imop.errors import CorruptData, ImopError, InvalidInput
from imop.evaluation.benchmark import tried
from imop.evaluation.episodes import Episode, EpisodeLog, method_state
from imop.evaluation.jobs import check_jobs
from imop.evaluation.methods import make_policy
from imop.evaluation.trials import DEMONSTRATION_SEED, Trial
from imop.reproduce.chains import against_parts
from imop.reproduce.measured import NOT_YET, Measured, MeasuredRow, MeasuredSection, Outcomes, assemble
from imop.reproduce.origin import code, commit, machine, parameters, weight_files
from imop.reproduce.table import Row, Section, Table

LOG, KEPT = "episodes.jsonl", "demonstrations"
_QUICK_SCENES = 3
_QUICK_EPISODES = 200
"""As many as two cores try in less than 20 minutes, with their demonstrations."""


@dataclass(frozen=True)
class Options:
    """How a table is measured.

    Attributes:
        out: folder of all tables: the log of episodes and the demonstrations, which they share, and a folder
            for each.
        quick: the first scenes of some of the tasks, for some of the rows.
        episodes: scenes of a task; None for the table's number.
        seed: of the first scene.
        jobs: processes.
        methods: only rows of these are tried, all if empty; the others are printed as far as they are logged.

    Raises:
        InvalidInput: for no scenes, seeds of demonstrations, or no processes.
    """

    out: Path = Path("runs/reproduce")
    quick: bool = False
    episodes: int | None = None
    seed: int = 7000
    jobs: int = 2
    methods: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.episodes is not None and self.episodes < 1:
            raise InvalidInput("episodes", f"{self.episodes}", "at least 1")
        if not 0 <= self.seed < DEMONSTRATION_SEED - (self.episodes or 0):
            raise InvalidInput("seed", f"{self.seed}", f"scenes from 0 to {DEMONSTRATION_SEED - 1}")
        check_jobs(self.jobs)

    def command(self, table: Table) -> str:
        """What one types to measure the table so."""
        usual = Options()
        words = ["imop", "reproduce", table.name, *(["--quick"] if self.quick else [])]
        for name in ("episodes", "seed"):
            if getattr(self, name) != getattr(usual, name):
                words += [f"--{name}", str(getattr(self, name))]
        return shlex.join(words)

    def tries(self, row: Row) -> bool:
        """Whether the row is tried."""
        return not self.methods or row.method in self.methods

    def scenes(self, table: Table) -> int:
        """Scenes of a task."""
        scenes = table.episodes if self.episodes is None else self.episodes
        return min(scenes, _QUICK_SCENES) if self.quick else scenes

    def folder(self, table: Table) -> Path:
        """Where the table is written."""
        return self.out / table.name / "quick" if self.quick else self.out / table.name


def rows_of(section: Section, quick: bool) -> tuple[Row, ...]:
    """The rows that are tried."""
    return tuple(row for row in section.rows if row.quick or not quick)


def trials_of(table: Table, section: Section, options: Options) -> dict[str, list[Trial]]:
    """The scenes of each task; those of a quick run are among those of the full one.

    Raises:
        ImopError: as `Section.trials`.
    """
    trials = section.trials(options.scenes(table), options.seed)
    if not options.quick:
        return trials
    rows = sum(len(rows_of(other, True)) for other in table.sections)
    return _spread(trials, max(1, _QUICK_EPISODES // (_QUICK_SCENES * rows))) if rows else trials


def _spread(trials: dict[str, list[Trial]], most: int) -> dict[str, list[Trial]]:
    """At most so many of the tasks, evenly spread."""
    names = list(trials)
    if len(names) <= most:
        return trials
    return {names[k * len(names) // most]: trials[names[k * len(names) // most]] for k in range(most)}


def measure(table: Table, options: Options, console: Console) -> Measured:
    """Try what can be tried, and say of the rest why not.

    Raises:
        InvalidInput: if a method is chosen that the table does not have.
        CorruptData: if the log cannot be read.
    """
    known = {row.method: None for section in table.sections for row in section.rows}
    if unknown := [method for method in options.methods if method not in known]:
        raise InvalidInput("methods", unknown[0], ", ".join(known) or "none, for there are none to measure")
    sections = tuple(_measured(table, section, options, console) for section in table.sections)
    parts = {chain: of_chain for section in table.sections for chain, of_chain in section.parts().items()}
    measured = _described(table, options, sections)
    return replace(measured, notes=(*against_parts(sections, parts), *measured.notes))


def not_measured(table: Table, options: Options) -> Measured:
    """The table before anything was measured."""
    sections = []
    for section in table.sections:
        rows = rows_of(section, options.quick)
        try:
            tasks = trials_of(table, section, options)
        except ImopError:
            tasks = {}
        missing = dict.fromkeys([row.label for row in rows], NOT_YET)
        sections.append(_section(section, tuple(tasks), assemble(rows, {}, missing)))
    return _described(table, options, tuple(sections))


def _measured(table: Table, section: Section, options: Options, console: Console) -> MeasuredSection:
    rows = rows_of(section, options.quick)
    try:
        trials = trials_of(table, section, options)
    except ImopError as error:
        return _section(section, (), assemble(rows, {}, {row.label: str(error) for row in rows}))
    outcomes: dict[str, Outcomes] = {}
    missing = {row.label: reason for row in rows if (reason := why_not(row))}
    there = [row for row in rows if row.label not in missing]
    for together in _together([row for row in there if options.tries(row)]):
        names = ", ".join(row.label for row in together)
        console.print(f"{section.title}: {names}")
        try:
            outcomes |= _tried(together, trials, table.focus, options, console)
        except CorruptData:
            raise  # of the log, which all rows need
        except ImopError as error:
            missing |= {row.label: str(error) for row in together}
    if left_out := [row for row in there if not options.tries(row)]:
        log = EpisodeLog(options.out / LOG)
        outcomes |= {
            row.label: found for row in left_out if (found := _logged(row, trials, table.focus, log))
        }
        missing |= {row.label: "left out by --methods" for row in left_out if row.label not in outcomes}
    return _section(section, tuple(trials), assemble(rows, outcomes, missing))


def _section(section: Section, tasks: tuple[str, ...], rows: tuple[MeasuredRow, ...]) -> MeasuredSection:
    known = tasks or tuple(dict.fromkeys(task for row in section.published for task in row.tasks))
    return MeasuredSection(section.title, known, tuple(section.absent()), rows, section.published)


def _together(rows: Sequence[Row]) -> Iterator[list[Row]]:
    """Rows that differ in nothing but the method see the same demonstrations, which are recorded once."""
    groups: dict[tuple[object, ...], list[Row]] = {}
    for row in rows:
        groups.setdefault((row.weights, row.disturb, row.demonstrations), []).append(row)
    yield from groups.values()


def _tried(
    rows: Sequence[Row], trials: Mapping[str, list[Trial]], focus: bool, options: Options, console: Console
) -> dict[str, Outcomes]:
    """What happened in every scene, by the rows' labels."""
    scenes = rows[0].tried_in(trials)
    everything = [trial for of_task in scenes.values() for trial in of_task]
    methods, log = [row.method for row in rows], options.out / LOG
    weights = rows[0].weights
    kept = options.out / KEPT
    found = tried(everything, methods, options.jobs, console, log, weights, focus, weights, kept)
    return {
        row.label: {
            task: [_outcome(found[trial, row.method]) for trial in of_task]
            for task, of_task in scenes.items()
        }
        for row in rows
    }


def _logged(row: Row, trials: Mapping[str, list[Trial]], focus: bool, log: EpisodeLog) -> Outcomes | None:
    """What happened in every scene, if all of them are in the log."""
    outcomes = {}
    for task, of_task in row.tried_in(trials).items():
        state = method_state(row.method, row.weights, of_task[0].task) + ("-focus" if focus else "")
        found = [log.find(trial, row.method, state) for trial in of_task]
        outcomes[task] = [_outcome(episode) for episode in found if episode is not None]
        if len(outcomes[task]) < len(of_task):
            return None
    return outcomes


def _outcome(episode: Episode) -> bool | None:
    """Whether it succeeded; None if there was no scene, or what should have disturbed it did not happen."""
    return None if episode.trial.disturb and not episode.disturbed else episode.success


@cache
def why_not(row: Row) -> str:
    """Why a row cannot be tried, and what would help; empty if it can."""
    if row.weights is not None and not all(f.is_file() for f in weight_files(row.method, row.weights)):
        return f"no weights in {row.weights}; {row.made_by}"
    try:
        make_policy(row.method, weights=row.weights)
    except InvalidInput as error:
        return f"{error.field}: {error.problem} is not there"
    except ImopError as error:
        return str(error)
    return ""


def _described(table: Table, options: Options, sections: tuple[MeasuredSection, ...]) -> Measured:
    if "parameters" in table.columns:
        sections = tuple(replace(section, rows=_sized(section.rows)) for section in sections)
    return Measured(
        table.name,
        table.title,
        options.command(table),
        commit(),
        code(),
        machine(),
        options.seed,
        options.scenes(table),
        options.quick,
        sections,
        table.notes,
        table.columns,
    )


def _sized(rows: Sequence[MeasuredRow]) -> tuple[MeasuredRow, ...]:
    return tuple(
        replace(row, parameters=parameters(row.method, Path(row.weights) if row.weights else None))
        for row in rows
    )
