"""Predicted against recorded gripper poses, open loop: each step of a scene is asked from its recorded state.

In simulation: one demonstration per task and variation, and scenes that the expert was recorded in.

    python benchmarks/open_loop.py --suite tabletop --split novel --scenes 3 --json open_loop.json

With `--instances other` every scene shows other objects than the demonstration: where their expert went is
right, and so is the demonstrated pose in the frame of the new object. Regions are compared with the
demonstrated objects.

On recordings in RLBench's layout: every ordered pair of episodes of the same task and variation. The robot is
removed by its kinematics; no instance ids, no names.

    python benchmarks/open_loop.py --demos ../shared/data/rlbench_demos --json open_loop_rlbench.json
"""

import json
import shlex
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import tyro
from joblib import delayed
from rich.console import Console
from rich.table import Table

from imop.errors import ImopError, InvalidInput
from imop.evaluation.cases import CaseOptions, made
from imop.evaluation.jobs import parallel
from imop.evaluation.methods import Policy, make_policy
from imop.evaluation.open_loop import Case, RecordedPoses, ask
from imop.evaluation.open_loop_rows import Row, by_task
from imop.evaluation.oracle import OraclePolicy
from imop.evaluation.picture import Panel, save_picture
from imop.evaluation.report import console_for_tables
from imop.files import replaced
from imop.geometry.accuracy import COARSE
from imop.types import Action


@dataclass
class Options(CaseOptions):
    """Settings of the benchmark.

    Attributes:
        methods: comma-separated: learned, registration, textbook (FPFH, RANSAC and ICP of Open3D, extra
            baselines), replay, oracle. By default all that need no extra, but no oracle on
            recordings, which do not tell where objects are.
        json: where the results and every single prediction go.
        pictures: folder for pictures of what the first method fails at.
        steps: also show every step of every task.
        jobs: processes.
    """

    methods: str = ""
    json: Path | None = None
    pictures: Path | None = None
    steps: bool = False
    jobs: int = 1


def policy_of(method: str, poses: RecordedPoses) -> Policy:
    return OraclePolicy(poses) if method == "oracle" else make_policy(method)


def evaluate(make_case: Callable[[], Case], methods: Iterable[str], pictures: Path | None) -> list[Row]:
    """Rows of all methods; pictures are made of what the first one fails at."""
    case = made(make_case)
    if case is None:
        return []
    rows = []
    for number, method in enumerate(methods):
        draw = partial(draw_failure, pictures) if pictures and number == 0 else None
        rows += list(ask(method, partial(policy_of, method), case, draw))
    return rows


def draw_failure(folder: Path, row: Row, case: Case, action: Action | None) -> None:
    """The demonstrated step with what was predicted, and with what would have been right."""
    if row.within(COARSE) or action is None:
        return
    support, query = case.demonstration.keyframes[row.step], case.queries[row.query].keyframes[row.step]
    assert row.position is not None
    off = f"{100 * row.position:.1f} cm, {row.rotation:.0f} deg off"
    panels = [
        Panel(support, query.observation, action, f"{row.task} {row.query} step {row.step}: {off}"),
        Panel(support, query.observation, query.action, "right"),
    ]
    save_picture(panels, folder / f"{row.task}-{row.query}-{row.support}-{row.step}.png")


def show(results: dict[str, dict[str, Any]], steps: bool, console: Console) -> None:
    table = Table(title="share of predictions near the recorded pose, up to symmetry")
    for name in ("method", "task", "step"):
        table.add_column(name)
    for name in ("n", "1 cm & 5°", "2 cm & 10°", "when it matters", "cm med (p90)", "deg med (p90)"):
        table.add_column(name, justify="right")
    for name in ("IoU", "routed", "ms", "conf."):
        table.add_column(name, justify="right")
    for method, result in results.items():
        for task, of_task in result["tasks"].items():
            for step, s in of_task["steps"].items() if steps else ():
                table.add_row(method, task, step, *cells(s))
            table.add_row(method, task, "all", *cells(of_task["all"]))
        table.add_row(method, "all", "all", *cells(result["all"]), style="bold", end_section=True)
    console.print(table)


def cells(s: dict[str, Any]) -> list[str]:
    def share(name: str) -> str:
        low, high = s[f"{name}_interval"]
        return f"{100 * s[name]:.0f} % [{100 * low:.0f}, {100 * high:.0f}]"

    def number(value: float | None, form: str, scale: float = 1.0) -> str:
        return "-" if value is None else format(scale * value, form)

    return [
        str(s["n"]),
        share("within_1cm_5deg"),
        share("within_2cm_10deg"),
        f"{number(s['within_2cm_10deg_of_not_repeatable'], '.0%')} of {s['not_repeatable']}",
        f"{number(s['position_median_m'], '.2f', 100)} ({number(s['position_p90_m'], '.1f', 100)})",
        f"{number(s['rotation_median_deg'], '.1f')} ({number(s['rotation_p90_deg'], '.1f')})",
        number(s["region_iou_mean"], ".2f"),
        number(s["routing_accuracy"], ".0%"),
        number(s["milliseconds_median"], ".0f"),
        number(s["confidence_median"], ".2f"),
    ]


def measure(options: Options, console: Console) -> dict[str, dict[str, Any]]:
    """Everything that goes into the JSON file, by method.

    Raises:
        ImopError: for options that do not fit, or recordings that cannot be used.
    """
    methods = (options.methods or f"learned,registration,replay{'' if options.demos else ',oracle'}").split(
        ","
    )
    if options.demos and "oracle" in methods:
        raise InvalidInput("methods", "oracle", "methods that need no object poses, for recordings")
    for method in methods:
        policy_of(method, RecordedPoses())
    work = [delayed(evaluate)(case, methods, options.pictures) for case in options.cases()]
    rows = [row for some in parallel(work, options.jobs, console, "demonstrations") for row in some]
    mine = {method: [row for row in rows if row.method == method] for method in methods}
    return {
        method: by_task(some) | {"rows": [row.as_dict() for row in some]}
        for method, some in mine.items()
        if some
    }


def main() -> int:
    options = tyro.cli(Options, description=__doc__)
    console = console_for_tables()
    started = time.perf_counter()
    try:
        results = measure(options, console)
    except ImopError as error:
        console.print(f"[red]{error}")
        return 2
    show(results, options.steps, console)
    if options.json:
        report = {
            "methods": results,
            "suite": str(options.demos or options.suite),
            "command": shlex.join(["python", *sys.argv]),
            "seconds": time.perf_counter() - started,
        }
        with replaced(options.json) as temporary:
            temporary.write_text(json.dumps(report, indent=1))
        console.print(f"written: {options.json}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
