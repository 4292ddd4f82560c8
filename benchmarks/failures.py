"""Why episodes of `imop eval` failed: table by task and cause, and a picture of one of each cause.

Every failed episode of the log is acted again after the same demonstration, also of other things than in the
scene, with code and weights as they are now; what succeeds now is counted as such. Pictures of RLBench must
not be distributed.

    imop eval --suite rlbench --methods learned --out DIR
    python benchmarks/failures.py --log DIR/episodes.jsonl --out DIR/failures --jobs 2
"""

import json
import shlex
import sys
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import tyro
from joblib import delayed
from rich.console import Console
from rich.table import Table

from imop.errors import ImopError, InvalidInput
from imop.evaluation.benchmark import shown_together
from imop.evaluation.causes import Cause, Diagnosis, diagnose
from imop.evaluation.episodes import read_episodes
from imop.evaluation.jobs import parallel
from imop.evaluation.picture import save_picture
from imop.evaluation.report import console_for_tables
from imop.evaluation.trials import Trial, demonstration_for
from imop.files import replaced

Found = tuple[Trial, Diagnosis | None]


@dataclass
class Options:
    """Settings.

    Attributes:
        log: episodes.jsonl of `imop eval`.
        out: folder of causes.json and the pictures.
        method: whose failures.
        weights: of the learned policy; by default the bundled ones.
        most: failed episodes of a task that are looked at.
        jobs: processes.
    """

    log: Path
    out: Path
    method: str = "learned"
    weights: Path | None = None
    most: int = 25
    jobs: int = 1


def failed(options: Options) -> list[Trial]:
    """Scenes in which the method's last attempt failed, at most so many of a task.

    Raises:
        InvalidInput: if there is no such log, or the method is not in it.
        CorruptData: if the log cannot be read.
    """
    last = {
        episode.trial: episode for episode in read_episodes(options.log) if episode.method == options.method
    }
    if not last:
        raise InvalidInput("log", f"no episode of {options.method} in {options.log}", "a log of `imop eval`")
    trials: list[Trial] = []
    for trial, episode in last.items():
        if episode.success is False and sum(t.task == trial.task for t in trials) < options.most:
            trials.append(trial)
    return trials


def look(trials: list[Trial], method: str, weights: Path | None) -> list[Found]:
    """The causes in scenes that share a demonstration."""
    demonstration = demonstration_for(trials[0])
    return [(trial, diagnose(trial, demonstration, method, weights)) for trial in trials]


def together(trials: list[Trial]) -> list[list[Trial]]:
    groups: dict[tuple[str, int, int, str], list[Trial]] = {}
    for trial in trials:
        groups.setdefault(shown_together(trial), []).append(trial)
    return list(groups.values())


def cause_of(diagnosis: Diagnosis | None) -> str:
    return "succeeds now" if diagnosis is None else str(diagnosis.cause)


def as_dict(trial: Trial, diagnosis: Diagnosis | None) -> dict[str, object]:
    row: dict[str, object] = {**asdict(trial), "cause": cause_of(diagnosis)}
    if diagnosis is None:
        return row
    centimetres, degrees = 100 * diagnosis.off[0], np.degrees(diagnosis.off[1])
    off = {"off_cm": round(centimetres, 2), "off_deg": round(float(degrees), 1)}
    off = off if np.isfinite(centimetres) else {}
    return row | {"action": diagnosis.action, "step": diagnosis.step, **off, "reason": diagnosis.reason}


def show(found: list[Found], console: Console) -> None:
    columns = [*map(str, Cause), "succeeds now"]
    table = Table("task", *columns, "first wrong steps", title="failures by what went wrong first")
    for task in dict.fromkeys(trial.task for trial, _ in found):
        mine = [diagnosis for trial, diagnosis in found if trial.task == task]
        counts = Counter(map(cause_of, mine))
        steps = Counter(d.step for d in mine if d is not None and d.cause in (Cause.REGION, Cause.MATCH))
        places = ", ".join(f"{step} ({count})" for step, count in steps.most_common())
        table.add_row(task, *(str(counts[c] or "") for c in columns), places)
    total = Counter(cause_of(diagnosis) for _, diagnosis in found)
    table.add_row("all", *(str(total[c]) for c in columns), "", style="bold")
    console.print(table)


def draw(found: list[Found], out: Path) -> None:
    """CAUSE.png of the first failure of every cause."""
    out.mkdir(parents=True, exist_ok=True)
    for cause in Cause:
        panels = [d.panel for _, d in found if d is not None and d.cause == cause and d.panel is not None]
        if panels:
            save_picture(panels[:1], out / f"{cause}.png")


def main() -> int:
    options = tyro.cli(Options, description=__doc__)
    console = console_for_tables()
    try:
        groups = together(failed(options))
        work = [delayed(look)(group, options.method, options.weights) for group in groups]
        found = [one for some in parallel(work, options.jobs, console, "demonstrations") for one in some]
    except ImopError as error:
        console.print(f"[red]{error}")
        return 2
    show(found, console)
    draw(found, options.out)
    report = {
        "command": shlex.join(["python", *sys.argv]),
        "method": options.method,
        "failures": [as_dict(trial, diagnosis) for trial, diagnosis in found],
    }
    with replaced(options.out / "causes.json") as temporary:
        temporary.write_text(json.dumps(report, indent=1))
    console.print(f"written: {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
