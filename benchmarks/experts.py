"""Success of the expert on every task of a suite, with a new instance of the objects in every scene.

    python benchmarks/experts.py --suite tabletop --seeds 50 --json experts.json

The file has the layout of `imop eval`'s results.json; "failures" adds the seed and reason of each failed
scene, "seconds" the median and longest wall time of an episode.
"""

import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro
from joblib import delayed
from rich.console import Console

from imop.errors import ImopError, InvalidInput
from imop.evaluation.jobs import parallel
from imop.evaluation.report import Count, Results, save_json
from imop.evaluation.splits import chosen_tasks
from imop.tasks.env import make_task
from imop.tasks.expert import record_demonstration


@dataclass
class Options:
    """Settings of the benchmark.

    Attributes:
        suite: which tasks.
        split: which of these.
        tasks: only these, by their names without the suite; all if empty.
        seeds: scenes per task; scene i has seed `first + i` and takes the variations in turn.
        first: the first seed.
        json: where the results go.
        jobs: processes.
    """

    suite: str = "tabletop"
    split: str = "all"
    tasks: tuple[str, ...] = ()
    seeds: int = 50
    first: int = 0
    json: Path | None = None
    jobs: int = 2


@dataclass(frozen=True)
class Attempt:
    """One episode of the expert; `problem` is empty if it succeeded."""

    task: str
    seed: int
    problem: str
    seconds: float


def attempt(name: str, seed: int) -> Attempt:
    task = make_task(name)
    started = time.perf_counter()
    try:
        record_demonstration(task, seed, seed % task.variations)
        problem = ""
    except ImopError as error:
        problem = str(error)
    return Attempt(name, seed, problem, time.perf_counter() - started)


def main() -> int:
    options = tyro.cli(Options, description=__doc__)
    console = Console()
    try:
        names = chosen_tasks(options.suite, options.split, options.tasks)
    except InvalidInput as error:
        console.print(f"[red]{error}")
        return 2
    seeds = range(options.first, options.first + options.seeds)
    work = [delayed(attempt)(name, seed) for name in names for seed in seeds]
    attempts = list(parallel(work, options.jobs, console, "episodes"))
    by_task = {name.split("/")[1]: [a for a in attempts if a.task == name] for name in names}
    counts = {task: Count(sum(not a.problem for a in of), len(of)) for task, of in by_task.items()}
    results = Results(
        options.suite, ",".join(options.tasks) or options.split, options.first, {"expert": counts}
    )
    console.print(results.table())
    failures = {task: {a.seed: a.problem for a in of if a.problem} for task, of in by_task.items()}
    seconds = {task: [a.seconds for a in of] for task, of in by_task.items()}
    for task in by_task:
        console.print(f"{task}: median {np.median(seconds[task]):.2f} s, longest {max(seconds[task]):.2f} s")
        for seed, problem in failures[task].items():
            console.print(f"  seed {seed}: {problem}")
    if options.json:
        timing = {t: {"median": float(np.median(s)), "max": max(s)} for t, s in seconds.items()}
        save_json(results.as_dict() | {"failures": failures, "seconds": timing}, options.json)
        console.print(f"written: {options.json}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
