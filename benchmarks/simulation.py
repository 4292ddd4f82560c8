"""Seconds per observation, plan, action and expert episode on this machine.

python benchmarks/simulation.py --json simulation.json
"""

import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import tyro
from scipy.spatial.transform import Rotation

from imop.errors import ImopError, PlanFailed
from imop.geometry import se3
from imop.sim.cameras import observe
from imop.sim.execute import Execution, execute
from imop.sim.world import TABLE_HEIGHT, World, scene_spec
from imop.tasks.expert import record_demonstration
from imop.tasks.tabletop import TABLETOP
from imop.types import Action

LIMITS = {"observation": 0.2, "action": 1.0, "episode": 6.0}
"""What issue 2 asks for: seconds, the median of each."""


@dataclass
class Arguments:
    """How much to measure, and where to write it."""

    json: Path | None = None
    """File for the results."""
    scenes: int = 8
    """Cluttered scenes in which random actions are tried."""
    actions: int = 15
    """Random actions in each."""
    episodes: int = 5
    """Expert episodes of every task."""


def cluttered_world(rng: np.random.Generator) -> World:
    """Four fixed boxes of up to half a metre in the middle of the table."""
    spec = scene_spec()
    for i in range(4):
        x, y, z = rng.uniform((0.02, 0.02, 0.05), (0.06, 0.06, 0.25))
        place = rng.uniform((0.0, -0.35), (0.55, 0.35))
        body = spec.worldbody.add_body(name=f"box{i}", pos=[*place, TABLE_HEIGHT + z])
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[x, y, z])
    return World(spec)


def random_action(rng: np.random.Generator) -> Action:
    """A pose over the table, pointing down within some 20 degrees."""
    tilt = rng.normal(scale=0.3, size=2)
    R = Rotation.from_euler("xyz", (np.pi + tilt[0], tilt[1], rng.uniform(-np.pi, np.pi))).as_matrix()
    return Action(se3.make(R, rng.uniform((0.0, -0.4, 0.8), (0.55, 0.4, 1.2))), gripper_open=True)


def measure_actions(arguments: Arguments) -> tuple[list[Execution], list[float], dict[str, int]]:
    """Executions, wall seconds of refusals, and how often each end happened."""
    done: list[Execution] = []
    refused: list[float] = []
    ends: dict[str, int] = {}
    for scene in range(arguments.scenes):
        rng = np.random.default_rng(scene)
        world = cluttered_world(rng)
        for i in range(arguments.actions):
            started = time.perf_counter()
            try:
                done.append(execute(world, random_action(rng), seed=i))
                end = "straight" if done[-1].straight else "searched"
            except PlanFailed as error:
                refused.append(time.perf_counter() - started)
                end = error.reason
            ends[end] = ends.get(end, 0) + 1
    return done, refused, ends


def measure_observations(count: int = 20) -> list[float]:
    """Wall seconds of four cameras on a cluttered scene."""
    world = cluttered_world(np.random.default_rng(0))
    seconds = []
    for _ in range(count):
        started = time.perf_counter()
        observe(world)
        seconds.append(time.perf_counter() - started)
    return seconds


def measure_episodes(name: str, count: int) -> tuple[list[float], int]:
    """Wall seconds of expert episodes with recording, and how many succeeded."""
    seconds, successes = [], 0
    for seed in range(count):
        started = time.perf_counter()
        task = TABLETOP[name]()
        try:
            record_demonstration(task, seed, variation=seed % task.variations)
            successes += 1
        except ImopError as error:
            print(f"{name}, seed {seed}: {error}")
        seconds.append(time.perf_counter() - started)
    return seconds, successes


def summary(seconds: list[float]) -> dict[str, float]:
    """Median, 90th percentile and maximum."""
    median, p90, largest = np.percentile(seconds, (50, 90, 100)) if seconds else (np.nan,) * 3
    return {"median": float(median), "p90": float(p90), "max": float(largest)}


def main(arguments: Arguments) -> None:
    done, refused, ends = measure_actions(arguments)
    results: dict[str, Any] = {
        "observation": summary(measure_observations()),
        "plan": summary([e.planning_seconds for e in done]),
        "refusal": summary(refused),
        "action": summary([e.wall_seconds for e in done]),
        "action_simulated": summary([e.simulated_seconds for e in done]),
    }
    successes = {}
    for name in TABLETOP:
        seconds, successes[name] = measure_episodes(name, arguments.episodes)
        results[f"episode {name}"] = summary(seconds)
    for name, row in results.items():
        limit = LIMITS.get(name.split()[0])
        note = f"   asked: median <= {limit:g}" if limit else ""
        print(f"{name:34} {row['median']:8.3f} {row['p90']:8.3f} {row['max']:8.3f} s{note}")
    print("ends of the random actions:", ends)
    print(f"expert successes of {arguments.episodes}:", successes)
    if arguments.json:
        everything = {"seconds": results, "action_ends": ends, "expert_successes": successes}
        arguments.json.write_text(json.dumps(everything, indent=2) + "\n")


if __name__ == "__main__":
    main(tyro.cli(Arguments))
