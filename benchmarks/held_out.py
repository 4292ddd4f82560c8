"""Poses predicted on things of families that no training has seen: pots, laptops, faucets, books, ropes.

Two executions of a procedural scene, things placed anew: the matcher watches the first and carries every
step's pose over to the state before the same step of the second, with its own answer to the step before as a
hint, as the policy does. A pose is right if it is near one of those that the known symmetries and equal
things allow. Only steps of which both sides see enough count, as in training. Routing is measured by
benchmarks/routing.py.

    python benchmarks/held_out.py --pairs 300 --seed 1007 --json held_out.json
    python benchmarks/held_out.py --kinds keep --pairs 100 --seed 1001 --mix 0 0 0 1     # other instances
    python benchmarks/held_out.py --families training --seed 7                          # while developing

With `--absent` the first step of every demonstration is also looked for in a scene of other things, where no
answer is right and a refusal is wanted; benchmarks/reliability.py counts these apart.
"""

import shlex
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import count, islice
from pathlib import Path
from typing import Literal

import numpy as np
import torch
import tyro
from joblib import Parallel, delayed
from rich.console import Console
from rich.table import Table

from imop.errors import ImopError
from imop.evaluation.report import console_for_tables, save_json
from imop.evaluation.statistics import wilson
from imop.evaluation.textbook import TextbookMatcher
from imop.geometry import se3
from imop.geometry.accuracy import COARSE, FINE, errors
from imop.geometry.neighbours import nearest, within
from imop.networks.model import BUNDLED, load_model
from imop.policy.interfaces import BEGINNING, Candidate, Matcher, Progress, Scene
from imop.policy.learned import LearnedMatcher
from imop.policy.registration import RegistrationMatcher
from imop.training.synthetic.families import HELD_OUT, TRAINING
from imop.training.synthetic.pairs import SAME_ONLY, synthetic_executions
from imop.training.synthetic.plans import check_kinds
from imop.training.synthetic.takes import SyntheticStep
from imop.training.verification.set_up import SetUp
from imop.types import FloatArray, Observation

PER_JOB = 10
"""Steps that are drawn from one seed; the results do not depend on the number of processes."""


@dataclass
class Options:
    """Settings of the benchmark.

    Attributes:
        pairs: how many steps.
        seed: of the scenes.
        families: those that no training has seen, or those that it sees.
        kinds: comma-separated kinds of what is done (`training.plans.SHARES`); all by default.
        mix: shares of scenes with the same things, others in colour, in shape, in both.
        absent: whether the first steps are also looked for where their things are not.
        methods: any of learned, registration and textbook (needs the extra baselines), joined by commas.
        weights: of the learned matcher.
        json: where the results go.
        jobs: processes.
    """

    pairs: int = 300
    seed: int = 7
    families: Literal["held_out", "training"] = "held_out"
    kinds: str = ""
    mix: tuple[float, float, float, float] = SAME_ONLY
    absent: bool = False
    methods: str = "learned,registration"
    weights: Path = BUNDLED
    json: Path | None = None
    jobs: int = 2


@dataclass(frozen=True)
class Row:
    """One predicted step.

    Attributes:
        method: whose prediction.
        scene: which one.
        step: of the demonstration.
        position, rotation: metres and degrees to the nearest right pose; None without an answer or where no
            answer is right.
        region_iou: of the region with the true one.
        confidence: 0 .. 1; 0 without an answer.
        seconds: to find it.
        absent: whether the things are not in the scene.
    """

    method: str
    scene: str
    step: int
    position: float | None
    rotation: float | None
    region_iou: float
    confidence: float
    seconds: float
    absent: bool = False

    def within(self, limits: tuple[float, float]) -> bool:
        """Whether both errors are below limits, metres and degrees."""
        if self.position is None or self.rotation is None:
            return False
        return self.position < limits[0] and self.rotation < limits[1]


def make_matcher(method: str, weights: Path) -> Matcher:
    if method == "textbook":
        return TextbookMatcher()
    if method == "registration":
        return RegistrationMatcher.from_pretrained(weights)
    return LearnedMatcher(load_model(weights))


def drawn(options: Options, number: int) -> Iterator[tuple[list[SyntheticStep], Observation | None]]:
    """The executions of one job, without end; see `synthetic_executions`."""
    content = int(np.random.SeedSequence([options.seed, number]).generate_state(1)[0])
    families = HELD_OUT if options.families == "held_out" else TRAINING
    rng = np.random.default_rng((content, 9))
    return synthetic_executions(families, options.mix, content, rng, kinds_of(options))


def kinds_of(options: Options) -> list[str]:
    return list(filter(None, options.kinds.split(",")))


def job(options: Options, number: int) -> list[Row]:
    """The rows of all methods for some scenes."""
    torch.set_num_threads(1)
    rows: list[Row] = []
    steps = 0
    matchers = {method: make_matcher(method, options.weights) for method in options.methods.split(",")}
    for i, (group, elsewhere) in enumerate(drawn(options, number)):
        for method, matcher in matchers.items():
            rows += predict(method, matcher, f"{number}-{i}", group, elsewhere if options.absent else None)
        steps += len(group)
        if steps >= PER_JOB:
            break
    return rows


def predict(
    method: str, matcher: Matcher, scene: str, group: Sequence[SyntheticStep], elsewhere: Observation | None
) -> Iterator[Row]:
    """The rows of one method for one demonstration and one query, and where its things are not, if given."""
    set_up, progress = SetUp(), BEGINNING
    shown = set_up.transitions(group[0].shown)
    prepared = matcher.prepare(shown)
    for example in group:
        k = example.step
        started = time.perf_counter()
        found = prepared[k].locate(set_up.see(example.asked.observations[k]), progress)
        seconds = time.perf_counter() - started
        progress = Progress(found[0].T_query_support) if found else BEGINNING
        overlap = iou(shown[k].before, prepared[k].region, example)
        yield Row(method, scene, k, *off(found, example), overlap, sure(found), seconds)
    if elsewhere is not None:
        started = time.perf_counter()
        found = prepared[0].locate(set_up.see(elsewhere))
        seconds = time.perf_counter() - started
        yield Row(method, scene, 0, None, None, 0.0, sure(found), seconds, absent=True)


def sure(found: Sequence[Candidate]) -> float:
    return found[0].probability if found else 0.0


def off(found: Sequence[Candidate], example: SyntheticStep) -> tuple[float | None, float | None]:
    """Metres and degrees from the answer to the nearest right pose."""
    if not found:
        return None, None
    position, rotation = errors(
        se3.orthonormal(found[0].T_query_support @ example.pair.T_world_goal), example.right_poses()
    )
    return float(position), float(np.degrees(rotation))


def iou(before: Scene, region: FloatArray, example: SyntheticStep) -> float:
    """Of the region that was found and the true one, over the points that were seen."""
    points = before.cloud.points
    owner = nearest(points, example.pair.support.points)[1][:, 0]
    mine, truth = within(points, region, 1e-6), example.pair.region[owner]
    return float((mine & truth).sum() / max((mine | truth).sum(), 1))


def summary(rows: Sequence[Row]) -> dict[str, object]:
    """Of one method; where no answer is right, nothing but the confidence counts."""
    absent, asked = [row for row in rows if row.absent], [row for row in rows if not row.absent]
    fine, coarse = (sum(row.within(limits) for row in asked) for limits in (FINE, COARSE))
    answered = [row for row in asked if row.position is not None]
    return {
        "n": len(asked),
        "scenes": len({row.scene for row in asked}),
        "within_1cm_5deg": fine / len(asked),
        "within_1cm_5deg_interval": wilson(fine, len(asked)),
        "within_2cm_10deg": coarse / len(asked),
        "within_2cm_10deg_interval": wilson(coarse, len(asked)),
        "position_median_m": float(np.median([row.position for row in answered])),
        "rotation_median_deg": float(np.median([row.rotation for row in answered])),
        "region_iou": float(np.mean([row.region_iou for row in asked])),
        "seconds_median": float(np.median([row.seconds for row in asked])),
        "absent": len(absent),
        "absent_confidence_median": float(np.median([row.confidence for row in absent])) if absent else None,
    }


def show(results: dict[str, dict], families: str, console: Console) -> None:
    table = Table(title=f"families: {families}; every step of two executions of a scene")
    for name in ("method", "steps", "scenes", "1 cm & 5°", "2 cm & 10°", "median", "region IoU", "s/match"):
        table.add_column(name, justify="right")
    for method, s in results.items():
        spans = [
            f"{100 * s[key]:.1f} % ({100 * s[key + '_interval'][0]:.0f}-{100 * s[key + '_interval'][1]:.0f})"
            for key in ("within_1cm_5deg", "within_2cm_10deg")
        ]
        median = f"{100 * s['position_median_m']:.2f} cm {s['rotation_median_deg']:.1f}°"
        seen = (f"{s['region_iou']:.2f}", f"{s['seconds_median']:.2f}")
        table.add_row(method, str(s["n"]), str(s["scenes"]), *spans, median, *seen)
    console.print(table)


def measure(options: Options) -> dict[str, list[Row]]:
    """At least `pairs` rows of every method.

    Raises:
        InvalidInput: for shares or kinds that there are not.
    """
    check_kinds(kinds_of(options))
    rows: dict[str, list[Row]] = {method: [] for method in options.methods.split(",")}
    first = next(iter(rows.values()))
    numbers = count()
    while True:
        calls = [delayed(job)(options, number) for number in islice(numbers, 2 * options.jobs)]
        for found in Parallel(n_jobs=options.jobs)(calls):
            for row in found:
                rows[row.method].append(row)
            if sum(not row.absent for row in first) >= options.pairs:
                return rows


def main() -> int:
    options = tyro.cli(Options, description=__doc__)
    console = console_for_tables()
    try:
        rows = measure(options)
    except ImopError as error:
        console.print(f"[red]{error}")
        return 2
    results = {method: summary(mine) for method, mine in rows.items()}
    show(results, options.families, console)
    if options.json:
        report = {
            "methods": results,
            "rows": [asdict(row) for mine in rows.values() for row in mine],
            "seed": options.seed,
            "command": shlex.join(["python", *sys.argv]),
        }
        save_json(report, options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
