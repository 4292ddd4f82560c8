"""Routes in files, like pairs: a cloud is stored once, whether it is demonstrated, asked about, or both."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from imop.training.data.route import Query, Route, SeenState
from imop.training.data.shards import cloud_arrays, read_arrays, read_cloud, starts, write_arrays

VERSION = 2
ROUTE_SHARD = 100
"""So many routes lie in a file."""


def write_routes(routes: Sequence[Route], path: Path) -> None:
    """Write routes as one compressed .npz file, whole or not at all."""
    every = {id(s): s for r in routes for s in _every(r)}
    number = {key: i for i, key in enumerate(every)}
    queries = [query for route in routes for query in route.queries]
    arrays: dict[str, NDArray[Any]] = {
        "version": np.array(VERSION),
        **cloud_arrays([seen.cloud for seen in every.values()]),
        "gripper": np.stack([seen.T_world_gripper for seen in every.values()]),
        "opening": np.array([seen.opening for seen in every.values()]),
        "states": np.array([number[id(seen)] for route in routes for seen in route.states]),
        "state_start": starts([len(route.states) for route in routes]),
        "queries": np.array([number[id(query.seen)] for query in queries]),
        "before": np.array([number[id(query.before)] for query in queries]),
        "kind": np.array([query.kind for query in queries]),
        "query_start": starts([len(route.queries) for route in routes]),
        "expected": np.array([query.expected for query in queries]),
        "right": np.concatenate([query.right for query in queries]),
        "right_start": starts([len(query.right) for query in queries]),
    }
    write_arrays(arrays, path)


def _every(route: Route) -> Iterator[SeenState]:
    yield from route.states
    for query in route.queries:
        yield query.seen
        yield query.before


class RouteShard:
    """The routes of one file, read into memory.

    Raises:
        CorruptData: if the file is not a whole shard of routes of this version.
    """

    def __init__(self, path: Path):
        self._arrays = read_arrays(path, VERSION, "state_start")
        self._known: dict[int, SeenState] = {}

    def __len__(self) -> int:
        return len(self._arrays["state_start"]) - 1

    def __getitem__(self, index: int) -> Route:
        a = self._arrays
        states = a["states"][slice(*a["state_start"][index : index + 2])]
        queries = range(*a["query_start"][index : index + 2])
        return Route(tuple(self._seen(int(i)) for i in states), tuple(self._query(i) for i in queries))

    def _query(self, number: int) -> Query:
        a = self._arrays
        right = a["right"][slice(*a["right_start"][number : number + 2])]
        seen, before = (self._seen(int(a[name][number])) for name in ("queries", "before"))
        return Query(seen, before, int(a["expected"][number]), right, str(a["kind"][number]))

    def _seen(self, number: int) -> SeenState:
        """Always the same object for the same number, so that what is made of it can be kept."""
        if number not in self._known:
            a = self._arrays
            cloud = read_cloud(a, number)
            self._known[number] = SeenState(cloud, a["gripper"][number], float(a["opening"][number]))
        return self._known[number]
