"""Poses predicted on things of families that no training has seen: pots, laptops, faucets, books, ropes.

Two demonstrations of the same procedural scene, things placed anew: the matcher watches the first and carries
every step's pose over to the state before the same step of the second, with its own answer to the step before
as a hint, as the policy does. A pose is right if it is near one of
those that the known symmetries and equal things allow. Only steps of which both sides see enough count, as in
training. Routing is measured by benchmarks/routing.py.

    python benchmarks/held_out.py --pairs 300 --seed 7 --json held_out.json
"""

import json
import shlex
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import torch
import tyro
from joblib import Parallel, delayed
from rich.console import Console
from rich.table import Table

from imop.evaluation.statistics import wilson
from imop.evaluation.textbook import TextbookMatcher
from imop.geometry import se3
from imop.geometry.accuracy import COARSE, FINE, errors
from imop.geometry.cloud import PointCloud
from imop.geometry.neighbours import within
from imop.geometry.perception import Perception
from imop.networks.model import BUNDLED, load_model
from imop.policy.interfaces import BEGINNING, Matcher, Progress, Transition
from imop.policy.interfaces import Scene as Seen
from imop.policy.learned import LearnedMatcher
from imop.policy.registration import RegistrationMatcher
from imop.robots.panda import panda_self_filter
from imop.sim.depth_noise import DepthNoise
from imop.training.families import HELD_OUT
from imop.training.families.thing import revolution
from imop.training.pairs import StepPair
from imop.training.scenes import Scene, demonstrate, draw_scene
from imop.training.stage import Unreachable
from imop.training.takes import Take, is_round, make_pair
from imop.types import Action, FloatArray, Observation


@dataclass
class Options:
    """Settings of the benchmark.

    Attributes:
        pairs: how many steps.
        seed: of the scenes.
        methods: any of learned, registration and textbook (needs the extra baselines), joined by commas.
        weights: of the learned matcher.
        json: where the results go.
        jobs: processes.
    """

    pairs: int = 300
    seed: int = 7
    methods: str = "learned,registration"
    weights: Path = BUNDLED
    json: Path | None = None
    jobs: int = 2


@dataclass(frozen=True)
class Row:
    """One predicted step: errors to the nearest right pose, metres and degrees."""

    method: str
    scene: int
    step: int
    position: float
    rotation: float
    region_iou: float
    confidence: float
    seconds: float


def make_matcher(method: str, weights: Path) -> Matcher:
    if method == "textbook":
        return TextbookMatcher()
    if method == "registration":
        return RegistrationMatcher.from_pretrained(weights)
    return LearnedMatcher(load_model(weights))


def observe(scene: Scene, rng: np.random.Generator) -> tuple[Take, list[Observation]]:
    """A demonstration with full clouds and what the policy may see of it."""
    states, noise = demonstrate(scene, rng), DepthNoise.sample(rng)
    perception = Perception(panda_self_filter().is_robot)
    observations = [scene.stage.observe(state, noise, rng) for state in states]
    poses = tuple(scene.stage.link_poses(state) for state in states)
    clouds = tuple(perception(observation) for observation in observations)
    take = Take(tuple(states), tuple(observations), clouds, poses)
    return take, [observation.stripped() for observation in observations]


def transitions(take: Take, observations: list[Observation]) -> list[Transition]:
    seen = [Seen(o, plain(take, k)) for k, o in enumerate(observations)]
    actions = [Action(state.T_world_gripper, state.gripper_open) for state in take.states[1:]]
    return [Transition(a, b, action) for a, b, action in zip(seen, seen[1:], actions, strict=False)]


def plain(take: Take, k: int) -> PointCloud:
    """The cloud of a state as the policy begins with it, without normals and what only the truth needs."""
    return replace(take.clouds[k], ids=None, normals=None)


def predict(
    matcher: Matcher,
    method: str,
    number: int,
    shown: Take,
    steps: list[Transition],
    queries: list[Seen],
    pairs,
) -> Iterator[Row]:
    prepared = matcher.prepare(steps)
    progress = BEGINNING
    for k, pair in pairs:
        started = time.perf_counter()
        found = prepared[k].locate(queries[k], progress)
        seconds = time.perf_counter() - started
        progress = Progress(found[0].T_query_support) if found else BEGINNING
        T = found[0].T_query_support if found else np.eye(4)
        goal = pair.T_world_goal
        position, rotation = errors(T @ goal, pair.T_query_support @ goal)
        truth = shown.clouds[k].points[pair.region]
        yield Row(
            method,
            number,
            k,
            position,
            float(np.degrees(rotation)),
            iou(prepared[k].region, truth),
            found[0].probability if found else 0,
            seconds,
        )


def with_every_turn(scene: Scene, shown: Take, k: int, pair: StepPair) -> StepPair:
    """The pair with turns of 2 degrees where a surface of revolution has, for training, turns of 30."""
    action = scene.recipe.steps[k]
    if action.link != "body" or not is_round(scene.stage.things[action.thing]):
        return pair
    axis = shown.poses[k][action.thing, "body"]
    spun = axis @ revolution(180) @ se3.invert(axis)
    return replace(pair, T_query_support=(pair.T_query_support[:, None] @ spun).reshape(-1, 4, 4))


def iou(region: FloatArray, truth: FloatArray) -> float:
    """Of two subsets of one cloud."""
    both = within(region, truth, 1e-6).sum()
    return float(both / (len(region) + len(truth) - both))


def scene_rows(number: int, seed: int, methods: tuple[str, ...], weights: Path) -> list[Row]:
    """All steps of one scene; none if the arm cannot do what was drawn."""
    torch.set_num_threads(1)
    rng = np.random.default_rng((seed, number))
    try:
        scene = draw_scene(HELD_OUT, rng)
        (shown, watched), (asked, seen) = observe(scene, rng), observe(scene, rng)
    except Unreachable:
        return []
    made = [make_pair(scene, shown, asked, k) for k in range(len(scene.recipe.steps))]
    pairs = [(e.step, with_every_turn(scene, shown, e.step, e.pair)) for e in made if e is not None]
    steps = transitions(shown, watched)
    queries = [Seen(observation, plain(asked, k)) for k, observation in enumerate(seen)]
    rows: list[Row] = []
    for method in methods:
        matcher = make_matcher(method, weights)
        rows += predict(matcher, method, number, shown, steps, queries, pairs)
    return rows


def summary(rows: list[Row]) -> dict[str, object]:
    position, rotation = (np.array([getattr(row, name) for row in rows]) for name in ("position", "rotation"))
    fine, coarse = ((position < metres) & (rotation < degrees) for metres, degrees in (FINE, COARSE))
    return {
        "n": len(rows),
        "scenes": len({row.scene for row in rows}),
        "within_1cm_5deg": float(fine.mean()),
        "within_1cm_5deg_interval": wilson(int(fine.sum()), len(rows)),
        "within_2cm_10deg": float(coarse.mean()),
        "within_2cm_10deg_interval": wilson(int(coarse.sum()), len(rows)),
        "position_median_m": float(np.median(position)),
        "rotation_median_deg": float(np.median(rotation)),
        "region_iou": float(np.mean([row.region_iou for row in rows])),
        "seconds_median": float(np.median([row.seconds for row in rows])),
    }


def show(results: dict[str, dict], console: Console) -> None:
    table = Table(title="held-out families, every step of two demonstrations of the same scene")
    for name in ("method", "steps", "scenes", "1 cm & 5°", "2 cm & 10°", "median", "region IoU", "s/match"):
        table.add_column(name, justify="right")
    for method, s in results.items():
        shares = [
            f"{100 * s[key]:.1f} % ({100 * s[key + '_interval'][0]:.0f}-{100 * s[key + '_interval'][1]:.0f})"
            for key in ("within_1cm_5deg", "within_2cm_10deg")
        ]
        median = f"{100 * s['position_median_m']:.2f} cm {s['rotation_median_deg']:.1f}°"
        table.add_row(
            method,
            str(s["n"]),
            str(s["scenes"]),
            *shares,
            median,
            f"{s['region_iou']:.2f}",
            f"{s['seconds_median']:.2f}",
        )
    console.print(table)


def main() -> int:
    options = tyro.cli(Options, description=__doc__)
    methods = tuple(options.methods.split(","))
    rows: list[Row] = []
    chunk = 8 * options.jobs
    number = 0
    while sum(row.method == methods[0] for row in rows) < options.pairs:
        calls = [
            delayed(scene_rows)(number + i, options.seed, methods, options.weights) for i in range(chunk)
        ]
        for found in Parallel(n_jobs=options.jobs)(calls):
            rows += found
        number += chunk
    results = {method: summary([row for row in rows if row.method == method]) for method in methods}
    console = Console()
    show(results, console if console.is_terminal else Console(width=120))
    if options.json:
        report = {
            "methods": results,
            "rows": [asdict(row) for row in rows],
            "seed": options.seed,
            "command": shlex.join(["python", *sys.argv]),
        }
        options.json.write_text(json.dumps(report, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
