"""`python -m imop.training.recorded`: shards of training pairs from recorded demonstrations.

Nobody annotates anything: regions come from Eq. (3), right motions from the recorded action poses.
"""

import argparse
from collections import defaultdict
from collections.abc import Iterator, Sequence
from itertools import chain, zip_longest
from pathlib import Path
from typing import TypeVar

import numpy as np

from imop.demos.regions import Aim, by_aim
from imop.demos.store import DemonstrationStore
from imop.errors import InvalidInput
from imop.robots.panda import panda_self_filter
from imop.training.pairs import StepPair
from imop.training.recorded_across import other_pairs
from imop.training.recorded_takes import Example, Take, group_pairs, take
from imop.training.shards import write_shard
from imop.training.takes import executions
from imop.types import Observation

T = TypeVar("T")
SHARD = 500
MOST = 6
"""Demonstrations that are paired with each other; more of the same make several groups."""


def groups(aims: Sequence[Aim], seed: int) -> list[list[int]]:
    """Numbers of demonstrations that show the same, in random order, with the tasks in turn."""
    same = by_aim(aims)
    rng = np.random.default_rng(seed)
    by_task: dict[str, list[list[int]]] = defaultdict(list)
    keys = list(same)
    for key in (keys[i] for i in rng.permutation(len(keys))):
        numbers = [same[key][i] for i in rng.permutation(len(same[key]))]
        parts = [numbers[i : i + MOST] for i in range(0, len(numbers), MOST)]
        by_task[key[0]] += [part for part in parts if len(part) > 1]
    return [group for row in zip_longest(*by_task.values()) for group in row if group]


def recorded_pairs(store: DemonstrationStore, seed: int = 0, others: float = 0.0) -> Iterator[StepPair]:
    """Pairs of a store, group by group, until those that are due next are used up.

    Args:
        store: of demonstrations.
        seed: of the order of the groups.
        others: share of the pairs whose query shows other objects than the demonstration.

    Raises:
        InvalidInput: if the share is none, or no demonstrations belong together in the way that is asked for.
    """
    same, other = (chain.from_iterable(stream) for stream in _streams(store, store.aims(), seed, others))
    return (example.pair for example in _shared(same, other, others))


def recorded_executions(
    store: DemonstrationStore, seed: int = 0, others: float = 0.0
) -> Iterator[tuple[list[Example], Observation | None]]:
    """The steps of each demonstration and query, in their order; with each, how another task begins.

    Args: as of `recorded_pairs`.

    Raises:
        InvalidInput: as `recorded_pairs`.
    """
    aims = store.aims()
    rng = np.random.default_rng((seed, 1))
    streams = _streams(store, aims, seed, others)
    same, other = (chain.from_iterable(map(executions, examples)) for examples in streams)
    for group in _shared(same, other, others):
        task = group[0].shown.demonstration.task
        elsewhere = [number for number, aim in enumerate(aims) if aim[0] != task]
        begins = store[int(rng.choice(elsewhere))].keyframes[0].observation if elsewhere else None
        yield group, begins


def _streams(
    store: DemonstrationStore, aims: Sequence[Aim], seed: int, others: float
) -> tuple[Iterator[list[Example]], Iterator[list[Example]]]:
    """All examples of group after group, and of couple after couple."""
    if not 0 <= others <= 1:
        raise InvalidInput("others", f"{others}", "a share, 0 to 1")
    found = groups(aims, seed)
    if not found:
        accepted = "two or more of the same task, variation and objects: imop collect --scenes 3"
        raise InvalidInput("store", f"no two of the {len(store)} demonstrations belong together", accepted)
    couples = _couples(aims, found)
    if others and not couples:
        accepted = "two or more sets of objects of the same task and variation, each in several scenes"
        raise InvalidInput("store", f"no two of the {len(found)} groups are of the same task", accepted)
    return _same(store, found), _others(store, couples)


def _shared(same: Iterator[T], other: Iterator[T], others: float) -> Iterator[T]:
    """Of both in their shares, until what is due next is used up."""
    streams, made = (same, other), [0, 0]
    while True:
        due = int(others * (sum(made) + 1) - made[1] > (1 - others) * (sum(made) + 1) - made[0])
        item = next(streams[due], None)
        if item is None:
            return
        made[due] += 1
        yield item


def _couples(aims: Sequence[Aim], found: list[list[int]]) -> list[tuple[list[int], list[int]]]:
    """Every group with the one before of the same task and variation, if that has other objects."""
    last: dict[tuple[str, int], list[int]] = {}
    couples = []
    for group in found:
        task, variation, instance = aims[group[0]]
        before = last.get((task, variation))
        if before is not None and aims[before[0]][2] != instance:
            couples.append((before, group))
        last[task, variation] = group
    return couples


def _same(store: DemonstrationStore, found: list[list[int]]) -> Iterator[list[Example]]:
    for group in found:
        yield group_pairs(_takes(store, group))


def _others(store: DemonstrationStore, couples: list[tuple[list[int], list[int]]]) -> Iterator[list[Example]]:
    for first, second in couples:
        yield other_pairs(_takes(store, first), _takes(store, second))


def _takes(store: DemonstrationStore, group: list[int]) -> list[Take]:
    is_robot = panda_self_filter().is_robot
    return [take(store[number], is_robot) for number in group]


def write_recorded(store: Path, out: Path, pairs: int, seed: int, others: float = 0.0) -> int:
    """Write up to `pairs` of `recorded_pairs` to numbered shards in `out`; returns how many there are."""
    out.mkdir(parents=True, exist_ok=True)
    waiting: list[StepPair] = []
    written = number = 0
    for pair in recorded_pairs(DemonstrationStore.open(store), seed, others):
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
    parser.add_argument(
        "--others", type=float, default=0.0, metavar="SHARE", help="share of pairs with other objects"
    )
    args = parser.parse_args()
    written = write_recorded(args.store, args.out, args.pairs, args.seed, args.others)
    print(f"{written} pairs in {args.out}")


if __name__ == "__main__":
    main()
