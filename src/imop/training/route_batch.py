"""Routes as tensors: a demonstration and some of its queries make a sample, samples side by side a batch."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from imop.networks.graph import GraphConfig, build_graph, collate
from imop.networks.routing import UNKNOWN, States
from imop.training.augment import seen_differently
from imop.training.routes import Query, Route, Seen

QUERIES = 8
"""How many queries of a route make a training sample."""


@dataclass(frozen=True, eq=False)
class RouteSample:
    """One route as tensors.

    Attributes:
        shown: the demonstrated states.
        query: some queries.
        right: (Q, L) True for the steps that are right.
    """

    shown: States
    query: States
    right: Tensor


@dataclass(frozen=True, eq=False)
class RouteBatch:
    """Samples side by side.

    Attributes:
        shown: all demonstrated states.
        demonstration: (S,) number of the sample of each.
        query: all queries.
        of: (Q,) number of the sample of each.
        right: (Q, L) True for right steps; as wide as the longest demonstration.
    """

    shown: States
    demonstration: Tensor
    query: States
    of: Tensor
    right: Tensor

    def to(self, device: torch.device | str) -> "RouteBatch":
        """The same batch on a device."""
        numbers = (self.demonstration.to(device), self.of.to(device), self.right.to(device))
        return RouteBatch(self.shown.to(device), numbers[0], self.query.to(device), *numbers[1:])


def make_route_sample(
    route: Route, config: GraphConfig, rng: np.random.Generator | None = None, blind: bool = False
) -> RouteSample:
    """Tensors of a route.

    Args:
        route: the route.
        config: how clouds become graphs.
        rng: for training: draws queries, augments them, and makes what is expected less reliable. Without it
            all queries are kept as they are.
        blind: whether what is expected is unknown.
    """
    queries = list(route.queries)
    states = list(route.states)
    expected = [UNKNOWN if blind else float(query.expected) for query in queries]
    if rng is not None:
        chosen = rng.permutation(len(queries))[:QUERIES]
        queries = [queries[i] for i in chosen]
        expected = [_expected(query, rng) for query in queries]
        queries, states = _differently(queries, states, rng)
    return RouteSample(
        make_states(states, list(range(len(states))), config),
        make_states([query.seen for query in queries], expected, config),
        torch.from_numpy(np.stack([query.right for query in queries])),
    )


def make_states(seen: Sequence[Seen], steps: Sequence[float], config: GraphConfig) -> States:
    """States as the network takes them; `steps` as in `States.step`."""
    return States(
        collate([build_graph(s.cloud, config) for s in seen]),
        torch.from_numpy(np.stack([s.T_world_gripper for s in seen]).astype(np.float32)),
        torch.tensor([s.opening for s in seen], dtype=torch.float32),
        torch.tensor(list(steps), dtype=torch.float32),
    )


def _expected(query: Query, rng: np.random.Generator) -> float:
    """What is expected in a training query: often nothing, sometimes one step too many or anything near."""
    kind = rng.random()
    if kind < 0.5:
        return UNKNOWN
    if kind < 0.85:
        return float(query.expected)
    return float(max(0, query.expected + (1 if kind < 0.95 else int(rng.integers(-2, 3)))))


def _differently(
    queries: Sequence[Query], states: Sequence[Seen], rng: np.random.Generator
) -> tuple[list[Query], list[Seen]]:
    """Demonstration and queries in other light, seen less well, with other readings of the gripper."""
    clouds = [*(query.seen.cloud for query in queries), *(state.cloud for state in states)]
    worse = seen_differently(clouds, len(queries), rng)
    readings = [*(query.seen.opening for query in queries), *(state.opening for state in states)]
    openings = np.clip(np.array(readings) + rng.normal(0, 0.01, len(readings)), 0.0, 1.0)
    seen = [
        Seen(cloud, old.T_world_gripper, float(opening))
        for cloud, old, opening in zip(worse, [*(q.seen for q in queries), *states], openings, strict=True)
    ]
    asked = [replace(query, seen=s) for query, s in zip(queries, seen, strict=False)]
    return asked, seen[len(queries) :]


def collate_routes(samples: Sequence[RouteSample]) -> RouteBatch:
    """One batch of several samples."""
    longest = max(sample.right.shape[1] for sample in samples)
    right = [torch.nn.functional.pad(s.right, (0, longest - s.right.shape[1])) for s in samples]
    return RouteBatch(
        _side_by_side([sample.shown for sample in samples]),
        _owner([sample.right.shape[1] for sample in samples]),
        _side_by_side([sample.query for sample in samples]),
        _owner([len(sample.right) for sample in samples]),
        torch.cat(right),
    )


def _side_by_side(states: Sequence[States]) -> States:
    return States(
        collate([s.graph for s in states]),
        torch.cat([s.T_world_gripper for s in states]),
        torch.cat([s.opening for s in states]),
        torch.cat([s.step for s in states]),
    )


def _owner(lengths: Sequence[int]) -> Tensor:
    return torch.arange(len(lengths)).repeat_interleave(torch.tensor(lengths))
