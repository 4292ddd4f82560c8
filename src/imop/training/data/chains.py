"""Routes from shards of pairs, without making a single cloud: successive steps share their states.

imop training chains --pairs DIR --out DIR
"""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import numpy as np

from imop.training.data.route import Query, Route, SeenState
from imop.training.data.route_shards import ROUTE_SHARD, write_routes
from imop.training.data.shards import Shard

FEWEST = 2


@dataclass(frozen=True)
class ChainConfig:
    """Which pairs become routes.

    Attributes:
        pairs: folder of shards of pairs.
        out: folder for the shards of routes.
        seed: of the widths of grasps.
    """

    pairs: Path
    out: Path
    seed: int = 0


def chained_routes(shard: Shard, rng: np.random.Generator) -> Iterator[Route]:
    """The routes in a shard: chains of pairs in which one's s_i' is the next one's s_i.

    A pair that is missing from a demonstration ends one chain and begins another. Pairs do not tell how wide
    closed fingers are: what is closed from the beginning is shut, and what closes later on something gets a
    width of its own, the same in all states and executions until it opens.
    """
    supports = shard.clouds
    after = {int(s): int(a) for s, a, _ in supports}
    ahead = {now: state for state, now in after.items()}
    seen = cache(partial(_seen, shard))
    queries: dict[int, list[int]] = defaultdict(list)
    first: dict[int, int] = {}
    for number, (support, _, query) in enumerate(supports):
        queries[int(support)].append(int(query))
        first.setdefault(int(support), number)
    begins = [state for state in after if state not in set(after.values())]
    for begin in begins:
        chain = [begin]
        while after[chain[-1]] in after:
            chain.append(after[chain[-1]])
        if len(chain) < FEWEST:
            continue
        widths = _widths([shard[first[state]].gripper_open[0] for state in chain], rng)
        asked = []
        for step, state in enumerate(chain):
            right = np.arange(len(chain)) == step
            for query in queries[state]:
                before = ahead.get(query) if step else query
                if query in first and before in first:
                    now = seen(first[query], widths[step])
                    asked.append(Query(now, seen(first[before], widths[max(step - 1, 0)]), step, right))
        yield Route(tuple(seen(first[s], w) for s, w in zip(chain, widths, strict=True)), tuple(asked))


def _seen(shard: Shard, number: int, opening: float) -> SeenState:
    """The support state of a pair."""
    pair = shard[number]
    return SeenState(pair.support, pair.T_world_now, opening)


def _widths(gripper_open: list[bool], rng: np.random.Generator) -> list[float]:
    width, widths = 0.0, []
    for before, now in zip([gripper_open[0], *gripper_open], gripper_open, strict=False):
        if before and not now:
            width = float(rng.uniform(0.05, 0.6))
        widths.append(1.0 if now else width)
    return widths


def chain(config: ChainConfig) -> int:
    """Write the routes of all shards of pairs in a folder to another; returns how many there are."""
    config.out.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(config.seed)
    routes: list[Route] = []
    written = 0
    paths = sorted(config.pairs.glob("*.npz"))
    for path in paths:
        routes += chained_routes(Shard(path), rng)
        while len(routes) >= ROUTE_SHARD or (path == paths[-1] and routes):
            part, routes = routes[:ROUTE_SHARD], routes[ROUTE_SHARD:]
            write_routes(part, config.out / f"shard-{written // ROUTE_SHARD:05d}.npz")
            written += len(part)
    return written
