"""How well keyframes that are found in raw recordings agree with the expert's own steps.

    python benchmarks/recorded_keyframes.py --robots panda,iiwa14 --seeds 4 --json keyframes.json

The expert is recorded as `imop record --simulated` does it, at 15 Hz, with noise of encoders, without joint
velocities; images are tiny, for keyframes do not depend on them. A step is found if a keyframe is within 1 cm
and 5 degrees of its pose, with the same state of the gripper, in the same order.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from imop.evaluation.report import save_json
from imop.evaluation.splits import chosen_tasks
from imop.geometry import se3
from imop.recording.draft import Draft
from imop.recording.simulated import record_expert
from imop.sim.cameras import CAMERAS
from imop.tasks.env import make_task
from imop.tasks.expert import ExpertFailed
from imop.tasks.layout import NoRoom
from imop.types import Demonstration

_NEAR = 0.01, np.radians(5.0)


def agreeing(draft: Draft, expert: Demonstration) -> int:
    """How many steps of the expert have a keyframe, in order: the longest common subsequence."""
    found = list(zip(draft.frames[1:], draft.gripper_open[1:], strict=True))
    T = draft.source.motion.T_world_gripper
    best = np.zeros((len(expert) + 1, len(found) + 1), dtype=np.int64)
    for i, keyframe in enumerate(expert.keyframes):
        action = keyframe.action
        for j, (frame, is_open) in enumerate(found):
            near = bool(se3.near(T[frame], action.T_world_gripper, *_NEAR)) and is_open == action.gripper_open
            best[i + 1, j + 1] = max(best[i, j + 1], best[i + 1, j], best[i, j] + near)
    return int(best[-1, -1])


def measure(
    robots: str = "panda",
    split: str = "base",
    seeds: int = 4,
    first: int = 0,
    rate: float = 15.0,
    json: Path | None = None,
) -> None:
    """Record every task of a split in several scenes, and count.

    Args:
        robots: arms, joined by commas.
        split: of the tabletop suite.
        seeds: scenes for each task and arm.
        first: seed of the first scene, and of its things.
        rate: frames per second.
        json: file for the numbers.
    """
    rows = []
    for robot in robots.split(","):
        for task in chosen_tasks("tabletop", split):
            row = {
                "robot": robot,
                "task": task,
                "episodes": 0,
                "steps": 0,
                "missing": 0,
                "extra": 0,
                "exact": 0,
            }
            for seed in range(first, first + seeds):
                with tempfile.TemporaryDirectory() as folder:
                    try:
                        draft, expert = record_expert(
                            Path(folder) / "take",
                            task,
                            robot=robot,
                            seed=seed,
                            variation=seed % make_task(task).variations,
                            instance=seed,
                            rate=rate,
                            cameras={"front": CAMERAS["front"]},
                            size=(8, 6),
                        )
                    except (ExpertFailed, NoRoom):
                        continue
                agreed, found = agreeing(draft, expert), len(draft.frames) - 1
                row["episodes"] += 1
                row["steps"] += len(expert)
                row["missing"] += len(expert) - agreed
                row["extra"] += found - agreed
                row["exact"] += agreed == found == len(expert)
            rows.append(row)
    table = Table(*rows[0])
    for row in rows:
        table.add_row(*(f"{value}" for value in row.values()))
    Console().print(table)
    if json is not None:
        save_json({"command": sys.argv, "rows": rows}, json)


if __name__ == "__main__":
    tyro.cli(measure)
