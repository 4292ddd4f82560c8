"""How far apart views with wrong camera poses show the same point, before and after they are aligned.

    python benchmarks/views.py --json views.json

The first states of tabletop scenes, seeds below 1000. Cameras get the same error in all scenes of a task.
Aligned alone: each observation by itself; together: once from all scenes of the task. Disagreement is what an
observation says of itself; apart is what only a simulator knows, the distance between where two views show
one point of the workspace. Times are ratios to fusing the views (`Perception.points`).
"""

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from imop.evaluation.report import save_json
from imop.evaluation.trials import Trial
from imop.geometry import se3
from imop.geometry.cloud import crop, fuse
from imop.geometry.perception import WORKSPACE_LOWER, WORKSPACE_UPPER, Perception
from imop.geometry.view_alignment import corrected, disagreement, find_errors
from imop.robots.panda import panda_self_filter
from imop.sim.depth_noise import DepthNoise
from imop.types import FloatArray, Observation

# Standard deviations of camera positions (metres) and rotations (degrees).
ERRORS = {"exact": (0.0, 0.0), "3 mm, 0.5 deg": (0.003, 0.5), "5 mm, 1 deg": (0.005, 1.0)}
NOISES = {"clean": DepthNoise(), "noisy": DepthNoise(0.06, 0.05, 0.5, 0.05)}


@dataclass
class Options:
    """Settings of the benchmark.

    Attributes:
        tasks: comma-separated names of base tasks.
        scenes: of each task.
        json: where the results go.
    """

    tasks: str = "tabletop/open_drawer,tabletop/stack_cubes,tabletop/lid_off_pot,tabletop/rubbish_in_bin"
    scenes: int = 3
    json: Path | None = None


def misplaced(observation: Observation, T_said_true: dict[str, FloatArray]) -> Observation:
    """The observation as if its cameras were said to be elsewhere."""
    return corrected(observation, {name: se3.invert(T) for name, T in T_said_true.items()})


def apart(observation: Observation, exact: Observation, points: FloatArray) -> float:
    """Mean distance between where two views show points (N, 3), over all pairs, metres."""
    shown = [
        se3.apply(view.T_world_camera @ se3.invert(exact.views[name].T_world_camera), points)
        for name, view in observation.views.items()
    ]
    pairs = [se3.lengths(p - q).mean() for i, p in enumerate(shown) for q in shown[:i]]
    return float(np.mean(pairs))


def measure(task: str, scenes: int, rng: np.random.Generator) -> list[dict[str, object]]:
    """One row for each scene, error and noise."""
    exact = [Trial(task, seed).env().observation.stripped() for seed in range(scenes)]
    rows: list[dict[str, object]] = []
    for error, (distance, degrees) in ERRORS.items():
        T_said_true = {
            name: se3.make(se3.euler(*rng.normal(0, np.radians(degrees), 3)), rng.normal(0, distance, 3))
            for name in exact[0].views
        }
        for noise, worse in NOISES.items():
            seen = [misplaced(worse(observation, rng), T_said_true) for observation in exact]
            together = find_errors(seen)
            for true, observation in zip(exact, seen, strict=True):
                rows.append(
                    {"task": task, "error": error, "noise": noise, **_row(true, observation, together)}
                )
    return rows


def _row(true: Observation, observation: Observation, together: dict[str, FloatArray]) -> dict[str, float]:
    points = crop(fuse(true), WORKSPACE_LOWER, WORKSPACE_UPPER).points[::50]
    started = time.process_time()
    alone = corrected(observation, find_errors([observation]))
    aligned = time.process_time()
    Perception(panda_self_filter().is_robot).points(observation)
    fused = time.process_time()
    row = {"time ratio": (aligned - started) / (fused - aligned)}
    known = corrected(observation, together)
    for name, views in {"before": observation, "alone": alone, "together": known}.items():
        row[f"disagreement {name}"] = 1000 * disagreement(views)
        row[f"apart {name}"] = 1000 * apart(views, true, points)
    return row


def main(options: Options) -> None:
    rng = np.random.default_rng(0)
    rows = [row for task in options.tasks.split(",") for row in measure(task, options.scenes, rng)]
    numbers = [key for key, value in rows[0].items() if isinstance(value, float)]
    table = Table("cameras", "depth", *numbers)
    for error in ERRORS:
        for noise in NOISES:
            own = [row for row in rows if (row["error"], row["noise"]) == (error, noise)]
            table.add_row(error, noise, *(f"{np.mean([row[key] for row in own]):.2f}" for key in numbers))
    Console(width=160).print(table, "distances in millimetres")
    if options.json:
        save_json({"rows": rows}, options.json)


if __name__ == "__main__":
    main(tyro.cli(Options))
