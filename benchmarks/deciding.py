"""How long policies take to decide: asked in turn for the same recorded states, one after the other.

    python benchmarks/deciding.py --suite tabletop --json FILE
    python benchmarks/deciding.py --demos ../shared/data/rlbench_demos --json FILE

From images to the action: clouds, the robot taken out of them, networks, search and judgement. One process
with as many threads as it likes, on a machine that does nothing else. Milliseconds differ from machine to
machine and from hour to hour; the ratios to the last method, asked for the same states within the same
second, do not.
"""

import json
import shlex
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from imop.errors import ImopError, InvalidInput, NoConfidentMatch
from imop.evaluation.cases import CaseOptions, made
from imop.evaluation.methods import make_policy
from imop.evaluation.open_loop import Case
from imop.evaluation.told import Told
from imop.files import replaced
from imop.policy.one_shot import OneShotPolicy


@dataclass
class Options(CaseOptions):
    """Settings of the benchmark.

    Attributes:
        methods: comma-separated; ratios are to the last one.
        json: where the results and every single time go.
    """

    methods: str = "learned,registration"
    json: Path | None = None


@dataclass(frozen=True)
class Times:
    """Milliseconds of each method for one state.

    Attributes:
        task: its name.
        query: name of the scene.
        step: of the demonstration.
        milliseconds: by method.
    """

    task: str
    query: str
    step: int
    milliseconds: dict[str, float]


def decisions(case: Case, methods: list[str]) -> Iterator[Times]:
    """Every method asked for every step of every scene, told which step it is."""
    shown = case.demonstration
    policies: dict[str, Told] = {}
    for method in methods:
        policy = make_policy(method)
        if not isinstance(policy, OneShotPolicy):
            raise InvalidInput("methods", method, "methods that look at images")
        policy.watch(shown.stripped())
        policies[method] = Told(policy)
    for query, recorded in case.queries.items():
        for policy in policies.values():
            policy.reset()
        for step in range(min(len(shown), len(recorded))):
            observation = recorded.keyframes[step].observation.stripped()
            taken = {}
            for method, policy in policies.items():
                started = time.perf_counter()
                with suppress(NoConfidentMatch):
                    policy.act(observation, step)
                taken[method] = 1000 * (time.perf_counter() - started)
            yield Times(case.task, query, step, taken)


def summary(rows: list[Times], methods: list[str]) -> dict[str, dict[str, float]]:
    """Milliseconds of every method, and how many times faster than the last one it is in the median."""
    found = {}
    for method in methods:
        taken, reference = (np.array([row.milliseconds[m] for row in rows]) for m in (method, methods[-1]))
        found[method] = {
            "n": len(rows),
            "median": float(np.median(taken)),
            "mean": float(taken.mean()),
            "p90": float(np.quantile(taken, 0.9)),
            "times_faster": float(np.median(reference) / np.median(taken)),
        }
    return found


def show(found: dict[str, dict[str, float]], console: Console) -> None:
    table = Table(title="milliseconds to decide")
    for name in ("method", "n", "median", "mean", "90 %", "times faster"):
        table.add_column(name, justify="left" if name == "method" else "right")
    for method, s in found.items():
        numbers = (f"{s[name]:.0f}" for name in ("n", "median", "mean", "p90"))
        table.add_row(method, *numbers, f"{s['times_faster']:.2f}")
    console.print(table)


def measure(options: Options) -> list[Times]:
    """All times.

    Raises:
        ImopError: for options that do not fit, or recordings that cannot be used.
    """
    rows = []
    for make_case in options.cases():
        if case := made(make_case):
            rows += list(decisions(case, options.methods.split(",")))
    return rows


def main() -> int:
    options = tyro.cli(Options, description=__doc__)
    console = Console()
    try:
        rows = measure(options)
    except ImopError as error:
        console.print(f"[red]{error}")
        return 2
    found = summary(rows, options.methods.split(","))
    show(found, console)
    if options.json:
        report = {
            "methods": found,
            "suite": str(options.demos or f"{options.suite} {options.split}"),
            "command": shlex.join(["python", *sys.argv]),
            "rows": [asdict(row) for row in rows],
        }
        with replaced(options.json) as temporary:
            temporary.write_text(json.dumps(report, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
