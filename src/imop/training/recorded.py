"""`python -m imop.training.recorded`: shards of training pairs from recorded demonstrations.

Nobody annotates anything: regions come from Eq. (3), right motions from the recorded action poses.
"""

import argparse
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

import numpy as np

from imop.demos.regions import SegmentedState, by_aim, invariant_region, segmented
from imop.demos.store import DemonstrationStore
from imop.errors import InvalidInput
from imop.geometry.cloud import PointCloud
from imop.geometry.perception import Perception, RobotMask
from imop.networks.graph import thin
from imop.robots.panda import panda_self_filter
from imop.training.pairs import StepPair
from imop.training.shards import write_shard
from imop.training.stage import STORED
from imop.training.symmetry import Scene, Surface, equal_motions
from imop.types import BoolArray, Demonstration, FloatArray, Observation

SHARD = 500
MOST = 6
"""Demonstrations that are paired with each other; more of the same make several groups."""
INVARIANT = 0.01
"""A region whose points are farther off than this in the partners is none, metres."""
OPEN = 0.9
"""A gripper is open from here on, as a policy sees it."""
_FEWEST_REGION, _FEWEST_QUERY = 12, 10


@dataclass(frozen=True, eq=False)
class Take:
    """A demonstration as clouds: one for each step, and one after the last.

    Attributes:
        demonstration: where it comes from.
        full: what a policy would see, with instance ids.
        clouds: the same as training stores it.
        segments: for each step, its objects in the frame of its action.
    """

    demonstration: Demonstration
    full: tuple[PointCloud, ...]
    clouds: tuple[PointCloud, ...]
    segments: tuple[SegmentedState, ...]

    def goal(self, step: int) -> FloatArray:
        """T_world_goal (4, 4) of a step."""
        return self.demonstration.keyframes[step].action.T_world_gripper

    def observation(self, step: int) -> Observation:
        """What was seen before a step."""
        return self.demonstration.keyframes[step].observation

    def part(self, step: int, names: Sequence[str]) -> PointCloud:
        """What is seen of these instances before a step."""
        return self.full[step].select(self.shows(self.full[step], step, names))

    def shows(self, cloud: PointCloud, step: int, names: Sequence[str]) -> BoolArray:
        """(N,) True for the points of a cloud of that step that belong to these instances."""
        known = self.observation(step).instance_names
        assert known is not None and cloud.ids is not None
        return np.isin(cloud.ids, [i for i, name in known.items() if name in names])


def take(demonstration: Demonstration, robot_mask: RobotMask | None) -> Take:
    """Look at every state of a demonstration.

    Raises:
        InvalidInput: if it has no segmentation.
    """
    keyframes = demonstration.keyframes
    segments = tuple(segmented(keyframe) for keyframe in keyframes)
    perceive = Perception(robot_mask)
    full = tuple(perceive(o) for o in (*(k.observation for k in keyframes), demonstration.final))
    return Take(demonstration, full, tuple(thin(cloud, STORED)[0] for cloud in full), segments)


def group_pairs(takes: Sequence[Take]) -> list[StepPair]:
    """All pairs of takes of the same task, variation and objects: every step, in both directions.

    Steps whose region is hidden, or where nothing stays in place in the partners, give none.
    """
    found = []
    steps = min((len(t.demonstration) for t in takes), default=0)
    for step in range(steps):
        scenes = {id(t): Scene(t.full[step], t.observation(step)) for t in takes}
        for support in takes:
            others = [t for t in takes if t is not support]
            if not others:
                return []
            region = invariant_region(support.segments[step], [t.segments[step] for t in others])
            if not region.names or region.displacement[region.names[0]] > INVARIANT:
                continue
            surface = Surface.pooled((t.part(step, region.names), t.goal(step)) for t in takes)
            for query in others:
                pair = _pair(support, query, step, region.names, surface, scenes[id(query)])
                if pair is not None:
                    found.append(pair)
    return found


def _pair(
    support: Take, query: Take, step: int, names: tuple[str, ...], surface: Surface, scene: Scene
) -> StepPair | None:
    cloud = support.clouds[step]
    mask = support.shows(cloud, step, names)
    seen = query.shows(query.clouds[step], step, names)
    if mask.sum() < _FEWEST_REGION or seen.sum() < _FEWEST_QUERY:
        return None
    keyframe = support.demonstration.keyframes[step]
    later = [query.goal(s) for s in range(step + 1, len(query.demonstration))]
    return StepPair(
        cloud,
        support.clouds[step + 1],
        query.clouds[step],
        mask,
        keyframe.action.T_world_gripper,
        keyframe.observation.T_world_gripper,
        (keyframe.observation.gripper_opening > OPEN, keyframe.action.gripper_open),
        equal_motions(surface, scene, support.goal(step), query.goal(step), later),
    )


def groups(store: DemonstrationStore, seed: int) -> list[list[int]]:
    """Numbers of demonstrations that show the same, in random order, with the tasks in turn."""
    same = by_aim(store)
    rng = np.random.default_rng(seed)
    by_task: dict[str, list[list[int]]] = defaultdict(list)
    keys = list(same)
    for key in (keys[i] for i in rng.permutation(len(keys))):
        numbers = [same[key][i] for i in rng.permutation(len(same[key]))]
        parts = [numbers[i : i + MOST] for i in range(0, len(numbers), MOST)]
        by_task[key[0]] += [part for part in parts if len(part) > 1]
    return [group for row in zip_longest(*by_task.values()) for group in row if group]


def recorded_pairs(store: DemonstrationStore, seed: int = 0) -> Iterator[StepPair]:
    """Every pair of a store, group by group.

    Raises:
        InvalidInput: if no two demonstrations show the same task with the same objects.
    """
    found = groups(store, seed)
    if not found:
        accepted = "two or more of the same task, variation and objects: imop collect --scenes 3"
        raise InvalidInput("store", f"no two of the {len(store)} demonstrations belong together", accepted)
    is_robot = panda_self_filter().is_robot
    for group in found:
        yield from group_pairs([take(store[number], is_robot) for number in group])


def write_recorded(store: Path, out: Path, pairs: int, seed: int) -> int:
    """Write up to `pairs` pairs to numbered shards in `out`; returns how many there are."""
    out.mkdir(parents=True, exist_ok=True)
    waiting: list[StepPair] = []
    written = number = 0
    for pair in recorded_pairs(DemonstrationStore.open(store), seed):
        waiting.append(pair)
        last = written + len(waiting) == pairs
        if len(waiting) == SHARD or last:
            write_shard(waiting, out / f"shard-{number:05d}.npz")
            written, number, waiting = written + len(waiting), number + 1, []
            print(f"{written} pairs", flush=True)
        if last:
            return written
    if waiting:
        write_shard(waiting, out / f"shard-{number:05d}.npz")
    return written + len(waiting)


def main() -> None:
    """Parse the command line."""
    parser = argparse.ArgumentParser(prog="python -m imop.training.recorded", description=__doc__)
    parser.add_argument("--store", type=Path, required=True, help="demonstrations by imop collect --scenes 3")
    parser.add_argument("--out", type=Path, required=True, help="folder of the shards")
    parser.add_argument("--pairs", type=int, required=True, help="at most so many")
    parser.add_argument("--seed", type=int, default=0, help="of the order of the groups")
    args = parser.parse_args()
    print(f"{write_recorded(args.store, args.out, args.pairs, args.seed)} pairs in {args.out}")


if __name__ == "__main__":
    main()
