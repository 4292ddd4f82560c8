"""How long collecting takes: seconds per recorded episode of every task of a split, retries included.

    python benchmarks/collecting.py --split base --episodes 6 --json collecting.json

CPU seconds are what an otherwise idle machine takes; wall seconds depend on what else runs.
"""

import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro
from joblib import delayed
from rich.console import Console
from rich.table import Table

from imop.evaluation.collect import COLLECTION_SEED, RETRY_STRIDE, Key, record
from imop.evaluation.jobs import parallel
from imop.evaluation.report import save_json
from imop.evaluation.splits import chosen_tasks
from imop.tasks.env import make_task


@dataclass
class Options:
    """Settings of the benchmark.

    Attributes:
        suite: which suite.
        split: which of its tasks.
        episodes: per task, the variations in turn.
        goal: episodes per task whose duration is extrapolated.
        json: where the results go.
        jobs: processes.
    """

    suite: str = "tabletop"
    split: str = "base"
    episodes: int = 6
    goal: int = 100
    json: Path | None = None
    jobs: int = 2


def timed(key: Key) -> tuple[float, float, float]:
    """Wall seconds, CPU seconds and failed attempts of one episode."""
    wall, cpu = time.perf_counter(), time.process_time()
    episode = record(key)
    failed = episode.seeds["episode"] // RETRY_STRIDE if episode else np.nan
    return time.perf_counter() - wall, time.process_time() - cpu, failed


def main() -> int:
    options = tyro.cli(Options, description=__doc__)
    console = Console()
    tasks = chosen_tasks(options.suite, options.split)
    keys = [
        (task, i % make_task(task).variations, COLLECTION_SEED + i, COLLECTION_SEED + i)
        for task in tasks
        for i in range(options.episodes)
    ]
    measured = np.array(
        list(parallel([delayed(timed)(key) for key in keys], options.jobs, console, "episodes"))
    )
    by_task = {task: measured[[key[0] == task for key in keys]] for task in tasks}
    table = Table()
    for column in ("task", "wall s", "CPU s", "longest wall s", "failed attempts"):
        table.add_column(column, justify="left" if column == "task" else "right")
    rows = {}
    for task, m in by_task.items():
        values = (m[:, 0].mean(), m[:, 1].mean(), m[:, 0].max())
        rows[task] = dict(zip(("wall_seconds", "cpu_seconds", "longest_wall_seconds"), values, strict=True))
        rows[task]["failed_attempts"] = m[:, 2].sum()
        table.add_row(task, *(f"{v:.2f}" for v in values), f"{m[:, 2].sum():.0f}")
    console.print(table)
    hours = {
        kind: options.goal * sum(row[f"{kind}_seconds"] for row in rows.values()) / options.jobs / 3600
        for kind in ("wall", "cpu")
    }
    console.print(
        f"{options.goal} episodes of each task with {options.jobs} processes: "
        f"{hours['wall']:.2f} h as measured, {hours['cpu']:.2f} h by CPU time"
    )
    if options.json:
        save_json({"tasks": rows, "goal": options.goal, "jobs": options.jobs, "hours": hours}, options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
