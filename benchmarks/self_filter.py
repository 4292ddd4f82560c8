"""How well the Panda's self-filter separates robot and scene on real RLBench demonstrations.

Every stored frame, every policy camera; the recorded instance masks say which points are robot. The
filter itself sees joint positions and gripper opening only.

    python benchmarks/self_filter.py --demos ../shared/data/rlbench_demos --json self_filter.json
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from imop.demos.rlbench import episodes, read_episode
from imop.evaluation.report import save_json
from imop.geometry.cloud import unproject
from imop.geometry.perception import WORKSPACE_LOWER, WORKSPACE_UPPER
from imop.geometry.self_filter import SelfFilter
from imop.robots.panda import panda_self_filter
from imop.types import BoolArray, CameraView, FloatArray, Observation

# RLBench's instance ids of the fingers, the hand and the links.
ROBOT_IDS = (31, 34, 35, *range(39, 47))
# Points this near to the tip of a gripper less open than this are what it holds, metres and fraction.
HELD_RADIUS = 0.03
CLOSED = 0.5


@dataclass
class Options:
    """Settings of the benchmark.

    Attributes:
        demos: a folder in RLBench's layout with instance masks.
        json: where the results go.
    """

    demos: Path
    json: Path | None = None


@dataclass
class Count:
    """How many of some points were removed."""

    removed: int = 0
    total: int = 0

    def add(self, removed: BoolArray, chosen: BoolArray) -> None:
        """Count those of the `chosen` points (N,) that were `removed` (N,)."""
        self.removed += int(np.count_nonzero(removed & chosen))
        self.total += int(np.count_nonzero(chosen))

    @property
    def fraction(self) -> float:
        """Removed points per point; NaN without points."""
        return self.removed / self.total if self.total else float("nan")


def observations(demos: Path) -> Iterator[tuple[Observation, FloatArray]]:
    """Every stored observation and its joint positions (7,)."""
    for path in episodes(demos):
        demonstration = read_episode(path)
        for observation in (
            *(keyframe.observation for keyframe in demonstration.keyframes),
            demonstration.final,
        ):
            if observation.joint_positions is None:
                raise SystemExit(f"{path} has no joint positions")
            yield observation, observation.joint_positions


def measure(self_filter: SelfFilter, demos: Path) -> dict[str, Count]:
    """Counts of removed points: of the robot, of all others, and of what the closed fingers hold.

    Points count within the workspace, and once more wherever they are.
    """
    counts = {name: Count() for name in ("robot", "other", "held", "robot_anywhere", "other_anywhere")}
    for observation, q in observations(demos):
        opening = observation.gripper_opening
        for view in observation.views.values():
            points, robot = labelled(view)
            removed = self_filter.is_robot(points, q, opening)
            inside = np.all((points >= WORKSPACE_LOWER) & (points <= WORKSPACE_UPPER), axis=1)
            counts["robot"].add(removed, robot & inside)
            counts["other"].add(removed, ~robot & inside)
            counts["robot_anywhere"].add(removed, robot)
            counts["other_anywhere"].add(removed, ~robot)
            if opening < CLOSED:
                tip = observation.T_world_gripper[:3, 3]
                near = np.linalg.norm(points - tip, axis=1) < HELD_RADIUS
                counts["held"].add(removed, ~robot & near)
    return counts


def labelled(view: CameraView) -> tuple[FloatArray, BoolArray]:
    """Points (N, 3) of a view and whether its mask says robot (N,)."""
    if view.instance_ids is None:
        raise SystemExit("the recordings have no instance masks to compare with")
    measured = view.measured
    points = unproject(view).reshape(*view.depth.shape, 3)[measured]
    return points, np.isin(view.instance_ids[measured], ROBOT_IDS)


def seconds_per_cloud(self_filter: SelfFilter, demos: Path, points: int = 50_000) -> float:
    """Median time of one call on a cloud of `points`."""
    observation, q = next(observations(demos))
    cloud = np.concatenate([labelled(view)[0] for view in observation.views.values()])[:points]
    times = []
    for _ in range(9):
        start = time.perf_counter()
        self_filter.is_robot(cloud, q, observation.gripper_opening)
        times.append(time.perf_counter() - start)
    return float(np.median(times))


def main(options: Options) -> None:
    self_filter = panda_self_filter()
    counts = measure(self_filter, options.demos)
    seconds = seconds_per_cloud(self_filter, options.demos)
    table = Table("points", "removed", "of", "fraction")
    for name, count in counts.items():
        table.add_row(name, str(count.removed), str(count.total), f"{count.fraction:.3%}")
    Console().print(table, f"{seconds * 1e3:.0f} ms per 50k points")
    if options.json:
        results = {f"{name}_removed": count.fraction for name, count in counts.items()}
        results |= {f"{name}_points": count.total for name, count in counts.items()}
        save_json(results | {"seconds_per_50k_points": seconds}, options.json)


if __name__ == "__main__":
    main(tyro.cli(Options))
