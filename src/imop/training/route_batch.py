"""Routes as tensors: a demonstration and some of its queries make a sample, samples side by side a batch."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import torch
from torch import Tensor

from imop.geometry.cloud import PointCloud
from imop.networks.graph import Graph, GraphConfig, build_graph, collate
from imop.networks.routing import UNKNOWN, States, make_states
from imop.training.augment import other_light
from imop.training.routes import Query, Route, Seen

QUERIES = 8
"""How many queries of a route make a training sample."""
IN_VAIN = 0.3
"""How many training queries are made of two states."""
LIGHT, LIGHT_NOISE = 0.25, 0.05
OPEN, EMPTY = 0.9, 0.03
POSITION_NOISE, OPENING_NOISE = 0.002, 0.01


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
    expected = [UNKNOWN if blind else float(query.expected) for query in queries]
    light = 0
    if rng is not None:
        light = int(rng.integers(2**32))
        queries = [queries[i] for i in rng.permutation(len(queries))[:QUERIES]]
        queries = [in_vain(route, rng) or q if rng.random() < IN_VAIN else q for q in queries]
        expected = [_expected(query, rng) for query in queries]
    return RouteSample(
        _states(route.states, list(range(len(route.states))), config, light, rng),
        _states([query.seen for query in queries], expected, config, light, rng),
        torch.from_numpy(np.stack([query.right for query in queries])),
    )


def _states(
    seen: Sequence[Seen],
    steps: Sequence[float],
    config: GraphConfig,
    light: int,
    rng: np.random.Generator | None,
) -> States:
    """States as tensors; with `rng` in other light (of the number `light`) and with other readings."""
    graphs = [graph_of(s.cloud, config) for s in seen]
    poses, opening = np.stack([s.T_world_gripper for s in seen]), np.array([s.opening for s in seen])
    if rng is not None:
        graphs = [other_light(g, np.random.default_rng(light), LIGHT) for g in graphs]
        graphs = [other_light(g, rng, LIGHT_NOISE) for g in graphs]
        poses[:, :3, 3] += rng.normal(0, POSITION_NOISE, (len(seen), 3))
        opening = np.clip(opening + rng.normal(0, OPENING_NOISE, len(seen)), 0.0, 1.0)
    return make_states(graphs, poses, opening.tolist(), steps)


def in_vain(route: Route, rng: np.random.Generator) -> Query | None:
    """A grasp that got nothing: the scene as before it, and the gripper where it went then.

    Clouds do not show the robot, so that the cloud of one state and the gripper of another make a state of
    their own. It calls for the approach before the grasp. None if the demonstration has no grasp.
    """
    openings = [state.opening for state in route.states]
    opened = [opening > OPEN for opening in openings]
    grasps = [
        k
        for k in range(1, len(opened) - 2)
        if opened[k - 1] and opened[k] and EMPTY < openings[k + 1] <= OPEN
    ]
    if not grasps:
        return None
    k = int(rng.choice(grasps))
    last = next((j for j in range(k + 1, len(opened)) if opened[j]), len(opened) - 1)
    j = int(rng.integers(k + 2, max(last, k + 2) + 1))
    asked: dict[int, list[Query]] = {}
    for query in route.queries:
        asked.setdefault(query.expected if query.expected < len(opened) else -1, []).append(query)
    scenes = [q for step in (k - 1, k) for q in asked.get(step, []) if q.right[step]]
    grippers = [q for q in asked.get(j, []) if q.right[j]]
    if not scenes or not grippers:
        return None
    before, later = scenes[int(rng.integers(len(scenes)))], grippers[int(rng.integers(len(grippers)))]
    opening = later.seen.opening if later.seen.opening > OPEN else 0.0
    state = replace(before.seen, T_world_gripper=later.seen.T_world_gripper, opening=opening)
    return Query(state, j, np.arange(len(opened)) == k - 1)


@lru_cache(maxsize=50_000)
def graph_of(cloud: PointCloud, config: GraphConfig) -> Graph:
    """The graph of a cloud; searching takes longer than learning, so the last ones are kept."""
    return build_graph(cloud, config)


def _expected(query: Query, rng: np.random.Generator) -> float:
    """What is expected in a training query: often nothing, sometimes one step too many or anything near."""
    kind = rng.random()
    if kind < 0.5:
        return UNKNOWN
    if kind < 0.85:
        return float(query.expected)
    return float(max(0, query.expected + (1 if kind < 0.95 else int(rng.integers(-2, 3)))))


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
