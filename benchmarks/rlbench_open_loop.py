"""Predicted against recorded gripper poses on real RLBench demonstrations, open loop.

Every ordered pair of episodes of the same task and variation: the policy watches the first and predicts every
keyframe of the second. No instance ids, no names: the robot is removed by its kinematics.

    python benchmarks/rlbench_open_loop.py --demos ../shared/data/rlbench_demos --json rlbench_open_loop.json
"""

import itertools
import json
import shlex
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from joblib import Parallel, delayed
from rich.console import Console
from rich.table import Table

from imop.demos.rlbench import episodes, read_episode
from imop.errors import ImopError
from imop.evaluation.open_loop import predict
from imop.evaluation.statistics import wilson
from imop.geometry.perception import Perception
from imop.policy.baselines import ReplayPolicy
from imop.policy.one_shot import OneShotPolicy
from imop.policy.registration import RegistrationMatcher
from imop.sim.robot import panda_self_filter

METHODS = ("replay", "registration")


@dataclass
class Options:
    """Settings of the benchmark.

    Attributes:
        demos: a folder in RLBench's layout: an episode, a task, or several tasks.
        json: where the results go.
        seed: of the sampling.
        jobs: processes.
    """

    demos: Path
    json: Path | None = None
    seed: int = 0
    jobs: int = 2


@dataclass(frozen=True)
class Row:
    """One predicted keyframe."""

    support: str
    query: str
    step: int
    position: float
    rotation: float
    confidence: float
    seconds: float


def make_policy(method: str, seed: int) -> ReplayPolicy | OneShotPolicy:
    if method == "replay":
        return ReplayPolicy()
    perception = Perception(robot_mask=panda_self_filter().is_robot)
    return OneShotPolicy(RegistrationMatcher(seed=seed), perception)


def pairs(paths: Sequence[Path]) -> list[tuple[Path, list[Path]]]:
    """Each episode with the others of its task and variation."""
    kind = {path: (read_episode(path).task, read_episode(path).variation) for path in paths}
    groups = [(a, [b for b in paths if b != a and kind[a] == kind[b]]) for a in paths]
    return [(a, others) for a, others in groups if others]


def evaluate(method: str, support: Path, queries: Sequence[Path], seed: int) -> list[Row]:
    """Watch one episode, predict the others."""
    policy = make_policy(method, seed)
    policy.watch(read_episode(support).stripped())
    rows = []
    for query in queries:
        for p in predict(policy, read_episode(query)):
            errors = (p.position_error, float(np.degrees(p.rotation_error)))
            rows.append(Row(support.name, query.name, p.step, *errors, p.action.confidence, p.seconds))
    return rows


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    position = np.array([row.position for row in rows])
    rotation = np.array([row.rotation for row in rows])
    good = int(np.sum((position < 0.01) & (rotation < 5)))
    coarse = int(np.sum((position < 0.02) & (rotation < 10)))
    return {
        "n": len(rows),
        "within_1cm_5deg": good / len(rows),
        "within_1cm_5deg_interval": wilson(good, len(rows)),
        "within_2cm_10deg": coarse / len(rows),
        "position_median_m": float(np.median(position)),
        "position_p90_m": float(np.percentile(position, 90)),
        "rotation_median_deg": float(np.median(rotation)),
        "rotation_p90_deg": float(np.percentile(rotation, 90)),
        "seconds_median": float(np.median([row.seconds for row in rows])),
        "confidence_median": float(np.median([row.confidence for row in rows])),
    }


def show(results: dict[str, dict[str, Any]], console: Console) -> None:
    table = Table(title="predicted against recorded pose, every keyframe of every ordered pair")
    for name in ("method", "step", "n", "1 cm & 5°", "95 % interval", "2 cm & 10°", "cm med (p90)"):
        table.add_column(name, justify="right")
    for name in ("deg med (p90)", "confidence", "s/step"):
        table.add_column(name, justify="right")
    for method, result in results.items():
        for step, s in [*result["steps"].items(), ("all", result)]:
            low, high = s["within_1cm_5deg_interval"]
            table.add_row(
                method,
                step,
                str(s["n"]),
                f"{100 * s['within_1cm_5deg']:.1f} %",
                f"{100 * low:.0f}-{100 * high:.0f}",
                f"{100 * s['within_2cm_10deg']:.1f} %",
                f"{100 * s['position_median_m']:.2f} ({100 * s['position_p90_m']:.2f})",
                f"{s['rotation_median_deg']:.2f} ({s['rotation_p90_deg']:.2f})",
                f"{s['confidence_median']:.2f}",
                f"{s['seconds_median']:.2f}",
            )
    console.print(table)


def main() -> int:
    options = tyro.cli(Options, description=__doc__)
    console = Console()
    # A pipe has no width of its own; the table needs 120 columns.
    console = console if console.is_terminal else Console(width=120)
    started = time.perf_counter()
    try:
        work = pairs(episodes(options.demos))
    except ImopError as error:
        console.print(f"[red]{error}")
        return 2
    if not work:
        console.print(f"[red]{options.demos}: no two episodes of the same task and variation")
        return 2
    results: dict[str, dict[str, Any]] = {}
    for method in METHODS:
        calls = [delayed(evaluate)(method, a, others, options.seed) for a, others in work]
        with console.status(f"{method}: {len(work)} demonstrations"):
            rows = list(itertools.chain.from_iterable(Parallel(n_jobs=options.jobs)(calls)))
        steps = sorted({row.step for row in rows})
        results[method] = summary(rows) | {
            "steps": {str(k): summary([row for row in rows if row.step == k]) for k in steps},
            "rows": [vars(row) for row in rows],
        }
    show(results, console)
    if options.json:
        report = {
            "methods": results,
            "seed": options.seed,
            "command": shlex.join(["python", *sys.argv]),
            "seconds": time.perf_counter() - started,
        }
        options.json.write_text(json.dumps(report, indent=1))
        console.print(f"written: {options.json}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
