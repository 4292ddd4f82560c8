import numpy as np
import pytest
import torch

from imop.errors import InvalidInput
from imop.networks.backbone import BackboneConfig
from imop.networks.graph import POINT_FEATURES, GraphConfig
from imop.networks.matching import MatchingConfig
from imop.networks.model import PAPER, SMALL, ModelConfig, load_model
from imop.networks.region import REGION_INPUTS, RegionConfig
from imop.networks.routing import INPUTS, RoutingConfig
from imop.training.ablation import Ablation
from imop.training.config import TrainConfig
from imop.training.data.shards import write_shard
from imop.training.loop.metrics import validate
from imop.training.loop.train import CHECKPOINT, train
from tests.training.data.test_pairs import pair


def backbone(inputs=POINT_FEATURES):
    return BackboneConfig(inputs, widths=(16,), depths=(1,))


TINY = ModelConfig(
    GraphConfig(max_points=40, grids=()),
    RegionConfig(backbone(REGION_INPUTS), stages=1),
    MatchingConfig(backbone(), layers=2, max_region=20, heads=2),
    RoutingConfig(backbone(INPUTS), width=16, layers=1, heads=2),
)

# Switches that do not meet in one network share a training, so that the test takes seconds.
ROWS = {
    "without the robot's state, K = 4": (
        Ablation(low_dimensional=False, neighbours=4),
        ("region", "matching"),
    ),
    "graph attention, K = 16": (Ablation(attention="graph", neighbours=16), ("region", "matching")),
    "no region": (Ablation(region_first=False), ("matching",)),
    "pose from matches": (Ablation(pose="from_matches"), ("region", "matching", "pose")),
    "regressed pose": (Ablation(pose="regressed"), ("pose",)),
}
LOSSES = {"region": {"focal", "dice", "spread"}, "matching": {"matching"}, "pose": {"pose"}}


@pytest.fixture(scope="module")
def shards(tmp_path_factory):
    folder = tmp_path_factory.mktemp("shards")
    write_shard([pair(i) for i in range(3)], folder / "0.npz")
    return folder


def config(shards, out, networks, **changes):
    settings = dict(
        batch=1, learning_rate=6e-3, warm_up=5, every=1000, ema=0.9, workers=0, precision="float32"
    )
    return TrainConfig(out, (shards,), networks=networks, **{**settings, "steps": 100, **changes})


@pytest.mark.parametrize("row", ROWS)
def test_every_row_of_the_table_trains(row, shards, tmp_path):
    ablation, networks = ROWS[row]
    shape = ablation.of(TINY)
    history = train(config(shards, tmp_path, networks), shape)
    assert len(history) == 100 and set(history[0]) == set().union(*(LOSSES[name] for name in networks))
    first, last = (
        {name: np.mean([h[name] for h in part]) for name in history[0]}
        for part in (history[:15], history[-15:])
    )
    # The pairs show the same things twice, which says nothing about others.
    learned = set(first) - {"spread"}
    assert all(last[name] < 0.8 * first[name] for name in learned), (first, last)
    model = load_model(tmp_path)
    assert model.config == shape
    assert all(0 <= value <= 1 for value in validate(model, shards, 2).values())


def test_a_pose_network_is_resumed_exactly(shards, tmp_path):
    shape = Ablation(pose="from_matches").of(TINY)
    settings = dict(networks=("region", "matching", "pose"), steps=4)
    whole = train(config(shards, tmp_path / "a", **settings), shape)
    first = train(config(shards, tmp_path / "b", **settings), shape, stop_at=2)
    assert whole == first + train(config(shards, tmp_path / "b", **settings), shape) and len(whole) == 4
    a, b = (torch.load(tmp_path / run / CHECKPOINT, weights_only=True)["model"] for run in "ab")
    assert any(name.startswith("pose.") for name in a) and all(torch.equal(a[name], b[name]) for name in a)


@pytest.mark.parametrize("base", [SMALL, PAPER], ids=["small", "paper"])
def test_nothing_chosen_changes_what_is_seen_and_how_it_is_matched(base):
    same = Ablation().of(base)
    assert (same.graph, same.region, same.matching, same.routing) == (
        base.graph,
        base.region,
        base.matching,
        base.routing,
    )
    assert same.pose.method == base.pose.method == "analytic"


def test_each_switch_reaches_its_networks():
    chosen = Ablation(False, "graph", False, 4, "regressed").of(SMALL)
    assert not chosen.region.low_dimensional and not chosen.routing.low_dimensional
    assert (chosen.matching.attention, chosen.matching.region_first) == ("graph", False)
    assert {chosen.graph.neighbours, chosen.matching.neighbours, chosen.route_graph.neighbours} == {4}
    assert chosen.pose.method == "regressed" and chosen.pose.backbone == SMALL.matching.backbone


@pytest.mark.parametrize(
    ("pose", "networks"),
    [
        ("analytic", ("region", "pose")),
        ("from_matches", ("pose",)),
        ("from_matches", ("region", "matching")),
        ("regressed", ("region", "matching")),
    ],
)
def test_networks_that_do_not_go_with_the_pose_are_refused(shards, tmp_path, pose, networks):
    with pytest.raises(InvalidInput, match="networks"):
        train(config(shards, tmp_path, networks), Ablation(pose=pose).of(TINY))
