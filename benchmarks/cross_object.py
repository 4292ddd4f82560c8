"""Shown with one grocery, tried with another: success of a method for every pair of the nine groceries.

    python benchmarks/cross_object.py --method registration --json cross_object.json

Rows are what was shown, columns what was tried. The cupboard's width and colours differ.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro
from joblib import delayed
from rich.console import Console
from rich.table import Table

from imop.errors import ImopError
from imop.evaluation.jobs import parallel
from imop.evaluation.methods import make_policy
from imop.evaluation.report import save_json
from imop.evaluation.rollout import rollout
from imop.evaluation.trials import Trial, demonstration_for
from imop.sim.parts.grocery import GROCERIES
from imop.types import Demonstration

TASK = "tabletop/grocery_in_cupboard"


@dataclass
class Options:
    """Settings of the benchmark.

    Attributes:
        method: how poses are carried over.
        trials: scenes per cell.
        diagonal: only the cells where the same grocery is shown and tried.
        first: seed of the first scene.
        json: where the results go.
        jobs: processes.
    """

    method: Literal["replay", "registration", "oracle"] = "registration"
    trials: int = 10
    diagonal: bool = False
    first: int = 0
    json: Path | None = None
    jobs: int = 2


def succeeds(method: str, demonstration: Demonstration, trial: Trial) -> bool:
    try:
        env = trial.env()
        policy = make_policy(method, env.world)
        policy.watch(demonstration if method == "oracle" else demonstration.stripped())
        return rollout(env, policy, len(demonstration)).success
    except ImopError:
        return False


def main() -> int:
    options = tyro.cli(Options, description=__doc__)
    console = Console()
    kinds = range(len(GROCERIES))
    cells = [(a, b) for a in kinds for b in kinds if a == b or not options.diagonal]
    recording = [delayed(demonstration_for)(Trial(TASK, 0, kind)) for kind in kinds]
    shown = list(parallel(recording, options.jobs, console, "demonstrations"))
    seeds = range(options.first, options.first + options.trials)
    work = [
        delayed(succeeds)(options.method, shown[a], Trial(TASK, seed, b)) for a, b in cells for seed in seeds
    ]
    results = list(parallel(work, options.jobs, console, "episodes"))
    n = options.trials
    successes = {cell: sum(results[i * n : (i + 1) * n]) for i, cell in enumerate(cells)}
    names = [kind.name for kind in GROCERIES]
    table = Table(title=f"{options.method}: successes of {n}, shown (rows) and tried (columns)")
    for name in ("", *names):
        table.add_column(name, justify="right" if name else "left")
    for a in kinds:
        table.add_row(names[a], *(str(successes.get((a, b), "")) for b in kinds))
    console.print(table)
    same = sum(successes[k, k] for k in kinds) / (n * len(names))
    console.print(f"same grocery: {100 * same:.1f} %")
    written = {"method": options.method, "trials": n, "groceries": names, "same": same}
    if not options.diagonal:
        other = sum(s for (a, b), s in successes.items() if a != b) / (n * len(names) * (len(names) - 1))
        console.print(f"another grocery: {100 * other:.1f} %")
        written["other"] = other
    if options.json:
        written["matrix"] = [[successes.get((a, b)) for b in kinds] for a in kinds]
        save_json(written, options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
