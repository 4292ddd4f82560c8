"""How much the confidence means: how often answers of a confidence are right, what a threshold refuses.

    python benchmarks/reliability.py held_out.json open_loop.json --out reliability.png --json FILE

Reads reports of benchmarks/held_out.py and benchmarks/open_loop.py. An answer is right within 2 cm and 10
degrees. The threshold is as high as it may be to refuse at most 5 % of the right first actions of episodes,
where nothing is known yet of what was done before. A step without an answer has no confidence; such steps are
only counted. Where the thing shown is not in the scene (held_out.py --absent), every answer is a wrong first
action. No answer counts as refused there. Neither counts anywhere else.
"""

import json
import shlex
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from imop.errors import CorruptData, ImopError, InvalidInput
from imop.evaluation.report import console_for_tables, save_json
from imop.evaluation.statistics import wilson
from imop.extras import extra
from imop.files import read, replaced
from imop.geometry.accuracy import COARSE
from imop.training.verification.fit import calibration_error, equal_bins

with extra("viz"):
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FALSE_ALARMS = 0.05
"""Share of the right first actions that may be refused."""


@dataclass
class Options:
    """Settings of the benchmark.

    Attributes:
        reports: of benchmarks/held_out.py or benchmarks/open_loop.py.
        methods: comma-separated; whose answers.
        out: where the diagram goes, a PNG.
        json: where the results go.
    """

    reports: Annotated[list[Path], tyro.conf.Positional]
    methods: str = "learned"
    out: Path | None = None
    json: Path | None = None


@dataclass(frozen=True)
class Answer:
    """What was answered for one step.

    Attributes:
        episode: which demonstration and scene.
        step: of the demonstration.
        confidence: 0 .. 1; None if there was no answer, but 0 where none is wanted.
        right: whether a right pose is near.
        absent: whether the things are not in the scene, so that nothing is right.
    """

    episode: tuple[str, ...]
    step: int
    confidence: float | None
    right: bool
    absent: bool = False


@dataclass(frozen=True)
class Share:
    """How many of some.

    Attributes:
        count: how many.
        of: out of how many.
    """

    count: int
    of: int

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's, 95 %."""
        return wilson(self.count, self.of)

    def __str__(self) -> str:
        if not self.of:
            return "-"
        low, high = self.interval
        return f"{100 * self.count / self.of:.0f} % [{100 * low:.0f}, {100 * high:.0f}] of {self.of}"


@dataclass(frozen=True)
class Bin:
    """Answers of about the same confidence.

    Attributes:
        confidence: their mean.
        right: how many of them are right.
    """

    confidence: float
    right: Share


@dataclass(frozen=True)
class Refusals:
    """What is refused below a threshold.

    Attributes:
        threshold: of the confidence.
        right_first: of the right first actions.
        wrong_first: of the wrong first actions.
        right: of all right answers.
        wrong: of all wrong answers.
        absent: of the first actions where the things are not in the scene; they are among the wrong ones.
    """

    threshold: float
    right_first: Share
    wrong_first: Share
    right: Share
    wrong: Share
    absent: Share


@dataclass(frozen=True)
class Reliability:
    """What the confidence of some answers means.

    Attributes:
        right: how many of the answers are right, where one can be.
        confidence: its mean.
        calibration: expected calibration error.
        silent: how many steps have no answer.
        bins: of equal count, the least confident first.
        refusals: None if no first action is right, so that no threshold follows.
    """

    right: Share
    confidence: float
    calibration: float
    silent: int
    bins: list[Bin]
    refusals: Refusals | None


def answers(path: Path, method: str) -> list[Answer]:
    """What a method answered in a report.

    Raises:
        CorruptData: if the file is missing or no such report.
        InvalidInput: if the method does not occur in it.
    """
    try:
        report = json.loads(read(path))
        # Of open_loop.py each method has its rows, of held_out.py they stand together.
        rows = report.get("rows") or [row for m in report["methods"].values() for row in m["rows"]]
        mine = [_answer(row) for row in rows if row["method"] == method]
        known = sorted({row["method"] for row in rows})
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        remedy = "give a report of benchmarks/held_out.py or benchmarks/open_loop.py"
        raise CorruptData(path, "has no rows with confidence, position and rotation", remedy) from error
    if not mine:
        raise InvalidInput("methods", f"{method} is not in {path}", ", ".join(known))
    return mine


def _answer(row: dict[str, Any]) -> Answer:
    """From a row of a report, of which held_out.py names the scene, open_loop.py where it was shown, too."""
    parts = ("scene",) if "scene" in row else ("task", "variation", "support", "query")
    position, rotation = row["position"], row["rotation"]
    right = position is not None and position < COARSE[0] and rotation < COARSE[1]
    episode = tuple(str(row[part]) for part in parts)
    if row.get("absent", False):
        return Answer((*episode, "absent"), row["step"], row["confidence"], False, True)
    # Nothing found is confidence 0 in held_out.py.
    return Answer(episode, row["step"], row["confidence"] or None, right)


def measure(found: Sequence[Answer]) -> Reliability:
    """What the confidence of answers of one method means.

    Raises:
        InvalidInput: if there is no answer among them.
    """
    given = [a for a in found if a.confidence is not None]
    asked = [a for a in given if not a.absent]
    if not asked:
        raise InvalidInput("reports", "no step has an answer", "at least one")
    sure = np.array([a.confidence for a in asked])
    hit = np.array([a.right for a in asked])
    return Reliability(
        Share(int(hit.sum()), len(hit)),
        float(sure.mean()),
        calibration_error(sure, hit.astype(float)),
        len(found) - len(given),
        [Bin(float(sure[b].mean()), Share(int(hit[b].sum()), len(b))) for b in equal_bins(sure)],
        refusals(found, given),
    )


def refusals(found: Sequence[Answer], given: Sequence[Answer]) -> Refusals | None:
    """What the highest threshold refuses that lets pass enough of the right first actions.

    Args:
        found: all steps; an episode begins with its first.
        given: those with an answer.
    """
    begun = {a.episode: a.step for a in sorted(found, key=lambda a: -a.step)}
    sure, hit = np.array([a.confidence for a in given]), np.array([a.right for a in given])
    first = np.array([a.step == begun[a.episode] for a in given])
    absent = np.array([a.absent for a in given])
    if not (hit & first).any():
        return None
    right_first = np.sort(sure[hit & first])
    threshold = right_first[int(FALSE_ALARMS * len(right_first))]

    def refused(which: np.ndarray) -> Share:
        return Share(int((sure[which] < threshold).sum()), int(which.sum()))

    shares = (refused(which) for which in (hit & first, ~hit & first, hit, ~hit, absent))
    return Refusals(float(threshold), *shares)


def show(results: dict[str, Reliability], console: Console) -> None:
    table = Table(title="what the confidence means (right: 2 cm & 10°)")
    for name in ("answers of", "n", "silent", "right", "confidence", "calibration error"):
        table.add_column(name, justify="left" if name == "answers of" else "right")
    refused = Table(
        title=f"refused by the threshold that refuses {FALSE_ALARMS:.0%} of the right first actions"
    )
    for name in (
        "answers of",
        "threshold",
        "right first",
        "wrong first",
        "right, all steps",
        "wrong, all steps",
        "absent",
    ):
        refused.add_column(name, justify="left" if name == "answers of" else "right")
    for name, r in results.items():
        numbers = (f"{r.confidence:.3f}", f"{r.calibration:.3f}")
        table.add_row(name, str(r.right.of), str(r.silent), str(r.right), *numbers)
        if r.refusals:
            s = r.refusals
            shares = (str(share) for share in (s.right_first, s.wrong_first, s.right, s.wrong, s.absent))
            refused.add_row(name, f"{s.threshold:.3f}", *shares)
    console.print(table, refused)


def save_diagram(results: dict[str, Reliability], path: Path) -> None:
    """One panel for each of the results: share of right answers over confidence, with Wilson intervals."""
    figure = Figure(figsize=(3.6 * len(results), 3.9), layout="constrained")
    axes = figure.subplots(1, len(results), squeeze=False)[0]
    for axis, (name, r) in zip(axes, results.items(), strict=True):
        _draw(axis, name, r)
    with replaced(path) as temporary:
        figure.savefig(temporary, dpi=110, format="png")


def _draw(axis: Axes, name: str, r: Reliability) -> None:
    shares = np.array([b.right.count / b.right.of for b in r.bins])
    low, high = np.array([b.right.interval for b in r.bins]).T
    # Rounding may leave an end of an interval on the wrong side of the share.
    ends = np.maximum([shares - low, high - shares], 0)
    axis.plot([0, 1], [0, 1], color="0.6", linewidth=1, linestyle="--")
    axis.errorbar([b.confidence for b in r.bins], shares, ends, fmt="o", markersize=4, capsize=2)
    axis.set(xlim=(0, 1), ylim=(0, 1), aspect="equal", xlabel="confidence", ylabel="share right")
    axis.set_title(f"{name}\nn = {r.right.of}, calibration error {r.calibration:.3f}", fontsize=8)


def results_of(options: Options) -> dict[str, Reliability]:
    """One for each method and report, by their names.

    Raises:
        ImopError: if there is no report, or one cannot be read or lacks a method.
    """
    if not options.reports:
        raise InvalidInput("reports", "none", "files that benchmarks/held_out.py or open_loop.py wrote")
    return {
        f"{method}, {path.with_suffix('')}": measure(answers(path, method))
        for path in options.reports
        for method in options.methods.split(",")
    }


def main() -> int:
    options = tyro.cli(Options, description=__doc__)
    console = console_for_tables()
    try:
        results = results_of(options)
    except ImopError as error:
        console.print(f"[red]{error}")
        return 2
    show(results, console)
    if options.out:
        save_diagram(results, options.out)
    if options.json:
        found = {name: asdict(r) for name, r in results.items()}
        save_json({"results": found, "command": shlex.join(["python", *sys.argv])}, options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
