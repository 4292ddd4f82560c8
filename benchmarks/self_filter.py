"""How much of the robot, and of everything else, the self-filter removes from real RLBench recordings.

    python benchmarks/self_filter.py --demos PATH --json FILE

The filter gets joint positions and the gripper's opening, nothing else. The masks of the recordings, which no policy reads,
say which points are robot. Counted are the points of the four policy cameras within the workspace, of frame 0 and of
every keyframe.
"""

import argparse
from collections import Counter
from pathlib import Path

import numpy as np

from imop.demos.rlbench import episodes, read_episode
from imop.evaluation.report import save_json
from imop.geometry import cloud as clouds
from imop.geometry.perception import WORKSPACE_LOWER, WORKSPACE_UPPER
from imop.sim.robot import panda_self_filter
from imop.types import Observation

# Instance ids of the Panda in the recordings: fingers, hand, links.
ROBOT_IDS = (31, 34, 35, *range(39, 47))
# Points this near to the tip of a closed gripper are what it holds, metres.
GRASPED = 0.03


def count(observation: Observation) -> Counter[str]:
    """Points of the robot, of the rest, and of what is held, and how many of each are removed."""
    cloud = clouds.crop(clouds.fuse(observation), WORKSPACE_LOWER, WORKSPACE_UPPER)
    assert cloud.ids is not None and observation.joint_positions is not None
    removed = panda_self_filter().is_robot(
        cloud.points, observation.joint_positions, observation.gripper_opening
    )
    robot = np.isin(cloud.ids, ROBOT_IDS)
    held = ~robot & (np.linalg.norm(cloud.points - observation.T_world_gripper[:3, 3], axis=1) < GRASPED)
    if observation.gripper_opening > 0.9:
        held[:] = False
    kinds = {"robot": robot, "other": ~robot, "held": held}
    counted: Counter[str] = Counter()
    for name, of_kind in kinds.items():
        counted[name] = int(of_kind.sum())
        counted[f"{name} removed"] = int((of_kind & removed).sum())
    return counted


def measure(demos: Path) -> dict[str, float]:
    """Fractions removed over all recordings below `demos`."""
    total: Counter[str] = Counter()
    for path in episodes(demos):
        demonstration = read_episode(path)
        for observation in (*(k.observation for k in demonstration.keyframes), demonstration.final):
            total += count(observation)
    kinds = ("robot", "other", "held")
    fractions = {f"{kind}_removed": total[f"{kind} removed"] / max(total[kind], 1) for kind in kinds}
    return fractions | {f"{kind}_points": total[kind] for kind in kinds}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--demos", type=Path, required=True, help="folder in RLBench's layout")
    parser.add_argument("--json", type=Path, help="write the numbers here")
    arguments = parser.parse_args()
    found = measure(arguments.demos)
    for kind in ("robot", "other", "held"):
        print(
            f"{kind:6} {found[f'{kind}_points']:8.0f} points, {100 * found[f'{kind}_removed']:.2f} % removed"
        )
    if arguments.json:
        save_json(found, arguments.json)


if __name__ == "__main__":
    main()
