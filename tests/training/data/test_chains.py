"""Routes from shards of pairs."""

from dataclasses import replace

import numpy as np
import pytest

from imop.training.data.chains import ChainConfig, chain, chained_routes
from imop.training.data.route_shards import RouteShard
from imop.training.data.shards import Shard, write_shard
from tests.networks.scenes import tabletop
from tests.training.data.test_pairs import pair


def executions(steps=3, without=()):
    """The pairs of two executions of `steps` steps, each the other's query, `without` some of the first.

    The gripper opens before the last step and is closed before that.
    """
    states = [[tabletop(10 * e + s) for s in range(steps + 1)] for e in range(2)]
    found = []
    for s in range(steps):
        for e in range(2):
            region = np.arange(len(states[e][s])) < 50
            opened = (s in (0, steps - 1), s == steps - 2)
            if e or s not in without:
                found.append(
                    replace(
                        pair(),
                        support=states[e][s],
                        after=states[e][s + 1],
                        query=states[1 - e][s],
                        region=region,
                        gripper_open=opened,
                    )
                )
    return found


@pytest.fixture
def routes(tmp_path):
    def made(pairs):
        write_shard(pairs, tmp_path / "a.npz")
        return list(chained_routes(Shard(tmp_path / "a.npz"), np.random.default_rng(0)))

    return made


def test_a_route_for_every_execution(routes):
    found = routes(executions())
    assert [len(r.states) for r in found] == [3, 3]
    for shown, tried in (found, found[::-1]):
        for step, query in enumerate(shown.queries):
            assert query.expected == step and np.flatnonzero(query.right).tolist() == [step]
            np.testing.assert_array_equal(query.seen.cloud.points, tried.states[step].cloud.points)


def test_fingers_keep_their_width_until_they_open(routes):
    for route in routes(executions(4)):
        opening = [state.opening for state in route.states]
        assert opening[0] == opening[3] == 1 and 0 < opening[1] == opening[2] < 1
        assert [q.seen.opening for q in route.queries] == opening


def test_a_missing_pair_ends_the_chain(routes):
    lengths = sorted(len(r.states) for r in routes(executions(5, without=(2,))))
    assert lengths == [2, 2, 5]


def test_shards_of_pairs_become_shards_of_routes(tmp_path):
    (tmp_path / "pairs").mkdir()
    for k in range(2):
        write_shard(executions(), tmp_path / "pairs" / f"{k}.npz")
    assert chain(ChainConfig(tmp_path / "pairs", tmp_path / "routes")) == 4
    (path,) = (tmp_path / "routes").glob("*.npz")
    assert len(RouteShard(path)) == 4
