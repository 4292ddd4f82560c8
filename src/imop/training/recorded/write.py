"""Shards of training pairs from recorded demonstrations.

Nobody annotates anything: regions come from Eq. (3), right motions from the recorded action poses.
"""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, islice, zip_longest
from pathlib import Path
from typing import TypeVar

import numpy as np

from imop.demos.regions import Aim, by_aim
from imop.demos.store import DemonstrationStore
from imop.errors import InvalidInput
from imop.robots.panda import panda_self_filter
from imop.training.data.executed import executions
from imop.training.data.pairs import StepPair
from imop.training.data.shards import SHARD, write_shard
from imop.training.recorded.across import other_pairs
from imop.training.recorded.segmented import RecordedStep, RecordedTake, group_pairs, segment
from imop.types import Observation

T = TypeVar("T")
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
) -> Iterator[tuple[list[RecordedStep], Observation | None]]:
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
) -> tuple[Iterator[list[RecordedStep]], Iterator[list[RecordedStep]]]:
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


def _same(store: DemonstrationStore, found: list[list[int]]) -> Iterator[list[RecordedStep]]:
    for group in found:
        yield group_pairs(_takes(store, group))


def _others(
    store: DemonstrationStore, couples: list[tuple[list[int], list[int]]]
) -> Iterator[list[RecordedStep]]:
    for first, second in couples:
        yield other_pairs(_takes(store, first), _takes(store, second))


def _takes(store: DemonstrationStore, group: list[int]) -> list[RecordedTake]:
    is_robot = panda_self_filter().is_robot
    return [segment(store[number], is_robot) for number in group]


@dataclass(frozen=True)
class RecordedConfig:
    """Which pairs of which demonstrations.

    Attributes:
        store: demonstrations by `imop collect --scenes 3`.
        out: folder of the shards.
        pairs: at most so many.
        seed: of the order of the groups.
        others: share of the pairs whose query shows other objects than the demonstration.
    """

    store: Path
    out: Path
    pairs: int
    seed: int = 0
    others: float = 0.0


def write_recorded(config: RecordedConfig) -> int:
    """Write up to `pairs` of `recorded_pairs` to numbered shards; returns how many there are."""
    config.out.mkdir(parents=True, exist_ok=True)
    store = DemonstrationStore.open(config.store)
    found = islice(recorded_pairs(store, config.seed, config.others), config.pairs)
    written = 0
    while pairs := list(islice(found, SHARD)):
        write_shard(pairs, config.out / f"shard-{written // SHARD:05d}.npz")
        written += len(pairs)
        print(f"{written} pairs", flush=True)
    return written
