"""Routes as tensors: a demonstration and some of its queries make a sample, samples side by side a batch."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import torch
from torch import Tensor

from imop.geometry.cloud import PointCloud
from imop.networks.changes import change_graph
from imop.networks.graph import Graph, GraphConfig, collate
from imop.networks.routing import States, make_states
from imop.training.data.augment import other_light, random_light
from imop.training.data.route import Query, Route, SeenState

QUERIES = 8
"""How many queries of a route make a training sample."""
HARD, HARD_ODDS = ("fallen", "slipped", "partial"), 4.0
"""Mishaps that the opening of the gripper does not tell are asked about more often in training."""
IN_VAIN = 0.15
"""How many training queries are made of two states."""
CUT = 0.5
"""How many routes are cut in training."""
LIGHT, LIGHT_NOISE = 0.25, 0.05
OPEN, EMPTY = 0.9, 0.03
POSITION_NOISE, OPENING_NOISE = 0.002, 0.01


@dataclass(frozen=True, eq=False)
class RouteSample:
    """One route as tensors.

    Attributes:
        shown: the demonstrated states.
        query: some queries.
        expected: (Q,) int64 number of the step that is expected next in each.
        right: (Q, L) True for the steps that are right.
    """

    shown: States
    query: States
    expected: Tensor
    right: Tensor


@dataclass(frozen=True, eq=False)
class RouteBatch:
    """Samples side by side.

    Attributes:
        shown: all demonstrated states.
        demonstration: (S,) number of the sample of each.
        query: all queries.
        of: (Q,) number of the sample of each.
        expected: (Q,) int64 number of the step that is expected next in each.
        right: (Q, L) True for right steps; as wide as the longest demonstration.
    """

    shown: States
    demonstration: Tensor
    query: States
    of: Tensor
    expected: Tensor
    right: Tensor

    def to(self, device: torch.device | str) -> "RouteBatch":
        """The same batch on a device."""
        shown, query = self.shown.to(device), self.query.to(device)
        rest = (t.to(device) for t in (self.of, self.expected, self.right))
        return RouteBatch(shown, self.demonstration.to(device), query, *rest)


def make_route_sample(
    route: Route, config: GraphConfig, rng: np.random.Generator | None = None
) -> RouteSample:
    """Tensors of a route.

    Args:
        route: the route.
        config: how clouds become graphs.
        rng: for training: draws queries, augments them, and makes what is expected less reliable. Without it
            all queries are kept as they are.
    """
    route = route if rng is None or rng.random() > CUT else cut(route, rng)
    queries = list(route.queries)
    expected = [query.expected for query in queries]
    light = 0
    if rng is not None:
        light = int(rng.integers(2**32))
        odds = np.array([HARD_ODDS if query.kind in HARD else 1.0 for query in queries])
        count = min(QUERIES, len(queries))
        drawn = rng.choice(len(queries), count, replace=False, p=odds / odds.sum())
        queries = [queries[i] for i in drawn]
        queries = [in_vain(route, rng) or q if rng.random() < IN_VAIN else q for q in queries]
        expected = [_expected(query, len(route.states), rng) for query in queries]
    shown = list(zip(route.states, (route.states[0], *route.states), strict=False))
    return RouteSample(
        _states(shown, config, light, rng),
        _states([(query.seen, query.before) for query in queries], config, light, rng),
        torch.tensor(expected),
        torch.from_numpy(np.stack([query.right for query in queries])),
    )


def _states(
    seen: Sequence[tuple[SeenState, SeenState]],
    config: GraphConfig,
    light: int,
    rng: np.random.Generator | None,
) -> States:
    """States, each with the one before it, as tensors; with `rng` in other light and with other readings."""
    looks = [changes_of(now.cloud, before.cloud, config) for now, before in seen]
    poses = np.array([[now.T_world_gripper, before.T_world_gripper] for now, before in seen])
    opening = np.array([[now.opening, before.opening] for now, before in seen])
    if rng is not None:
        poses[..., :3, 3] += rng.normal(0, POSITION_NOISE, (len(seen), 2, 3))
        opening = np.clip(opening + rng.normal(0, OPENING_NOISE, opening.shape), 0.0, 1.0)
    states = make_states(looks, poses, opening)
    if rng is None:
        return states
    shared = random_light(np.random.default_rng(light), LIGHT)
    lights = [shared @ random_light(rng, LIGHT_NOISE) for _ in seen]
    return replace(states, graph=other_light(states.graph, lights))


def cut(route: Route, rng: np.random.Generator) -> Route:
    """The route without some steps at its ends, with the queries to which a step that is left is right."""
    steps = len(route.states)
    end = int(rng.integers(2, steps + 1)) if rng.random() < 0.7 else steps
    begin = int(rng.integers(0, end - 1)) if rng.random() < 0.5 else 0
    queries = tuple(
        replace(query, expected=query.expected - begin, right=query.right[begin:end])
        for query in route.queries
        if begin <= query.expected <= end and query.right[begin:end].any() and not query.right[:begin].any()
    )
    return Route(route.states[begin:end], queries) if queries else route


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
    still = scenes[int(rng.integers(len(scenes)))].seen
    still = replace(still, T_world_gripper=later.before.T_world_gripper, opening=0.0)
    return Query(state, still, j, np.arange(len(opened)) == k - 1, "missed")


@lru_cache(maxsize=50_000)
def changes_of(now: PointCloud, before: PointCloud, config: GraphConfig) -> tuple[Graph, Tensor]:
    """As `change_graph`; searching takes longer than learning, so the last ones are kept."""
    return change_graph(now, before, config)


def _expected(query: Query, steps: int, rng: np.random.Generator) -> int:
    """What is expected in a training query: sometimes one step too many or anything near."""
    kind = rng.random()
    off = 0 if kind > 0.08 else 1 if kind > 0.04 else int(rng.integers(-2, 3))
    return int(np.clip(query.expected + off, 0, steps))


def collate_routes(samples: Sequence[RouteSample]) -> RouteBatch:
    """One batch of several samples."""
    longest = max(sample.right.shape[1] for sample in samples)
    right = [torch.nn.functional.pad(s.right, (0, longest - s.right.shape[1])) for s in samples]
    return RouteBatch(
        _side_by_side([sample.shown for sample in samples]),
        _owner([sample.right.shape[1] for sample in samples]),
        _side_by_side([sample.query for sample in samples]),
        _owner([len(sample.right) for sample in samples]),
        torch.cat([sample.expected for sample in samples]),
        torch.cat(right),
    )


def _side_by_side(states: Sequence[States]) -> States:
    return States(
        collate([s.graph for s in states]),
        torch.cat([s.change for s in states]),
        torch.cat([s.T_world_gripper for s in states]),
        torch.cat([s.opening for s in states]),
    )


def _owner(lengths: Sequence[int]) -> Tensor:
    return torch.arange(len(lengths)).repeat_interleave(torch.tensor(lengths))
