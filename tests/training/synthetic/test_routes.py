"""Routes: synthetic ones, their shards, their tensors."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from imop.errors import CorruptData, InvalidInput
from imop.networks.graph import GraphConfig
from imop.training.data.route import Query, Route, SeenState
from imop.training.data.route_batch import QUERIES, collate_routes, cut, in_vain, make_route_sample
from imop.training.data.route_shards import RouteShard, write_routes
from imop.training.data.shards import Shard
from imop.training.synthetic.families import TRAINING
from imop.training.synthetic.generate import GenerateConfig, generate
from imop.training.synthetic.mishaps import mishaps
from imop.training.synthetic.routes import indistinguishable, synthetic_routes
from imop.training.synthetic.scenes import demonstrate, draw_scene
from imop.training.synthetic.stage import Unreachable
from tests.networks.scenes import tabletop
from tests.networks.test_networks import GOAL

GRAPH = GraphConfig(max_points=60)


def seen(seed, opening=1.0):
    return SeenState(tabletop(seed), GOAL, opening)


def route(seed=0, steps=3):
    """As many queries as steps, and one after a mishap."""
    states = tuple(seen(seed + i, i / steps) for i in range(steps))
    asked = [seen(seed + 20 + i) for i in range(steps)]
    queries = tuple(Query(s, asked[max(i - 1, 0)], i, np.arange(steps) == i) for i, s in enumerate(asked))
    mishap = Query(seen(seed + 40), asked[-1], steps, np.arange(steps) == 0, "missed")
    return Route(states, (*queries, mishap))


@pytest.fixture(scope="module")
def made():
    return list(synthetic_routes(2, 16, TRAINING))


def test_every_state_but_the_last_is_asked_about(made):
    for r in made:
        plain = [q for q in r.queries[: len(r.states)]]
        assert [q.expected for q in plain] == list(range(len(r.states)))
        assert all(q.right[q.expected] for q in plain)
        assert all(q.right.shape == (len(r.states),) for q in r.queries)


def test_mishaps_are_asked_about_and_never_skip_a_step(made):
    wrong = [q for r in made for q in r.queries[len(r.states) :]]
    assert wrong
    assert all(np.flatnonzero(q.right)[0] <= q.expected for q in wrong)
    assert any(not q.right[q.expected] for q in wrong if q.expected < len(q.right))
    assert {"missed", "moved", "slipped", "partial"} <= {q.kind for q in wrong}
    assert {q.kind for r in made for q in r.queries[: len(r.states)]} == {"ordinary"}


def test_the_same_seed_gives_the_same_routes(made):
    (again,) = synthetic_routes(2, 1, TRAINING)
    for a, b in zip(made[0].queries, again.queries, strict=True):
        np.testing.assert_array_equal(a.seen.cloud.points, b.seen.cloud.points)
        np.testing.assert_array_equal(a.right, b.right)


def test_every_query_knows_the_state_before_it(made):
    for r in made:
        plain = [q.seen for q in r.queries[: len(r.states)]]
        assert [q.before for q in r.queries[1 : len(plain)]] == plain[:-1]
        assert r.queries[0].before is plain[0]
        for q in r.queries[len(plain) :]:
            if q.expected:
                last = plain[q.expected - 1]
                assert any(q.before.cloud is state.cloud for state in plain[: q.expected])
                assert q.before.T_world_gripper is last.T_world_gripper
                assert q.before.opening in (0.0, last.opening)
            else:
                assert q.before is q.seen


def test_queries_stand_elsewhere(made):
    moved = [np.abs(r.states[0].T_world_gripper - r.queries[0].seen.T_world_gripper).max() for r in made]
    assert min(moved) > 0.01


def executions(count):
    rng = np.random.default_rng(5)
    while count:
        try:
            scene = draw_scene(TRAINING, rng, (0.5, 0.5))
            states = demonstrate(scene, rng)
        except Unreachable:
            continue
        count -= 1
        yield scene, states, rng


def test_after_a_mishap_nothing_lost_is_in_the_hand():
    """With which step one goes on says what must be held then: what was held when it was demonstrated."""
    checked = 0
    for scene, states, rng in executions(12):
        for mishap in mishaps(scene, states, rng, 6):
            # A part that begins by opening the hand may begin with something or nothing in it.
            opens = scene.script.steps[mishap.right].gripper_open
            assert opens or (mishap.state.held is None) == (states[mishap.right].held is None)
            assert 0 <= mishap.right <= mishap.expected <= len(scene.script.steps)
            checked += mishap.right < mishap.expected
    assert checked > 10


def test_states_are_the_same_as_themselves_and_after_nothing_happened():
    for scene, states, _ in executions(3):
        poses = [scene.stage.link_poses(state) for state in states]
        again = indistinguishable([*states, states[0]], [*poses, poses[0]])
        assert again[0, -1] and again[-1, 0]
        assert again.diagonal().all()
        assert not again[0, 1]


def test_a_query_needs_a_right_step():
    with pytest.raises(InvalidInput, match="right"):
        Route((seen(0),), (Query(seen(1), seen(0), 0, np.array([False])),))


def test_shards_give_back_what_was_written(tmp_path):
    write_routes([route(0), route(1, steps=2)], tmp_path / "a.npz")
    shard = RouteShard(tmp_path / "a.npz")
    assert [len(shard[i].states) for i in range(len(shard))] == [3, 2]
    for wrote, read in zip((route(0), route(1, steps=2)), (shard[0], shard[1]), strict=True):
        for a, b in zip(wrote.states, read.states, strict=True):
            np.testing.assert_allclose(a.cloud.points, b.cloud.points, atol=1e-6)
            np.testing.assert_array_equal(a.T_world_gripper, b.T_world_gripper)
            assert a.opening == b.opening
        for a, b in zip(wrote.queries, read.queries, strict=True):
            np.testing.assert_allclose(a.seen.cloud.points, b.seen.cloud.points, atol=1e-6)
            np.testing.assert_array_equal(a.right, b.right)
            np.testing.assert_allclose(a.before.cloud.points, b.before.cloud.points, atol=1e-6)
            assert (a.expected, a.kind) == (b.expected, b.kind)


def test_shards_of_pairs_and_of_routes_are_not_confused(tmp_path):
    generate(GenerateConfig(tmp_path, routes=2))
    (path,) = tmp_path.glob("*.npz")
    assert len(RouteShard(path)) == 2
    with pytest.raises(CorruptData, match="another kind"):
        Shard(path)
    written = path.stat().st_mtime_ns
    generate(GenerateConfig(tmp_path, routes=2))
    assert path.stat().st_mtime_ns == written


def test_tensors_of_a_whole_route():
    sample = make_route_sample(route(), GRAPH)
    assert sample.expected.tolist() == [0, 1, 2, 3]
    assert sample.right.sum(dim=1).tolist() == [1, 1, 1, 1]
    np.testing.assert_allclose(sample.shown.opening, [[0, 0], [1 / 3, 0], [2 / 3, 1 / 3]], atol=1e-6)


def test_training_draws_queries_and_makes_expectations_unreliable():
    samples = [make_route_sample(route(steps=9), GRAPH, np.random.default_rng(s)) for s in range(30)]
    assert max(len(s.right) for s in samples) == QUERIES
    off = torch.cat([s.expected - s.right.float().argmax(dim=1) for s in samples])
    assert (off == 0).float().mean() > 0.7 and (off == 1).any()


def test_a_cut_route_keeps_what_can_still_be_answered():
    """The query after a mishap needs the first step and, as all were done, the last."""
    for s in range(20):
        whole = route(steps=6)
        part = cut(whole, np.random.default_rng(s))
        begin = next(i for i, state in enumerate(whole.states) if state is part.states[0])
        assert part.states == whole.states[begin : begin + len(part.states)] and len(part.states) >= 2
        for query in part.queries:
            assert 0 <= query.expected <= len(part.states)
            old = next(q for q in whole.queries if q.seen is query.seen)
            assert np.flatnonzero(old.right)[0] == begin + np.flatnonzero(query.right)[0]
            assert old.expected == begin + query.expected


def test_training_asks_more_often_what_is_hard_to_see():
    asked = [make_route_sample(hard(k), GRAPH, np.random.default_rng(k)) for k in range(60)]
    assert np.mean([(s.expected == 3).any() for s in asked]) > 0.45


def hard(seed):
    """Ten ordinary queries and one about a thing that fell."""
    whole = route(seed % 3)
    fallen = replace(whole.queries[3], kind="fallen", expected=3)
    return Route(whole.states, (*(whole.queries[:3] * 10)[:30], fallen))


def test_a_batch_keeps_routes_apart():
    batch = collate_routes([make_route_sample(route(0, 3), GRAPH), make_route_sample(route(1, 2), GRAPH)])
    assert batch.demonstration.tolist() == [0, 0, 0, 1, 1]
    assert batch.of.tolist() == [0] * 4 + [1] * 3
    assert batch.right.shape == (7, 3) and not batch.right[4:, 2].any()
    assert batch.shown.graph.size == 5 and batch.query.graph.size == 7


def test_a_grasp_in_vain_shows_the_scene_before_it_and_an_empty_hand():
    """Opening per state: open, open, closed on something, closed on it, open again."""
    openings = (1.0, 1.0, 0.3, 0.3, 1.0)
    states = tuple(seen(i, opening) for i, opening in enumerate(openings))
    asked = [seen(20 + i, opening) for i, opening in enumerate(openings)]
    queries = tuple(Query(s, asked[max(i - 1, 0)], i, np.arange(5) == i) for i, s in enumerate(asked))
    scenes = [asked[i].cloud for i in (0, 1)]
    found = [in_vain(Route(states, queries), np.random.default_rng(s)) for s in range(20)]
    assert {query.expected for query in found} == {3, 4}
    for query in found:
        assert any(query.seen.cloud is cloud for cloud in scenes)
        assert query.seen.opening == (0.0 if query.expected == 3 else 1.0)
        assert query.before.opening == 0.0 and any(query.before.cloud is cloud for cloud in scenes)
        assert np.flatnonzero(query.right).tolist() == [0]


def test_without_a_grasp_nothing_is_in_vain():
    states = tuple(seen(i, 0.0) for i in range(4))
    assert (
        in_vain(Route(states, (Query(seen(9), seen(8), 0, np.arange(4) == 0),)), np.random.default_rng(0))
        is None
    )
