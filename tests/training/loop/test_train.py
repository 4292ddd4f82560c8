import json
import os
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import torch

from imop.errors import CorruptData, InvalidInput
from imop.geometry import se3
from imop.networks.graph import GraphConfig
from imop.networks.matching import MatchingConfig
from imop.networks.model import SMALL, Model, ModelConfig, load_model, save_model
from imop.training.data.datasets import PairDataset, loader
from imop.training.data.route_shards import write_routes
from imop.training.data.shards import write_shard
from imop.training.loop.train import CHECKPOINT, LOG, TrainConfig, schedule, train
from tests.networks.test_networks import REGION, TINY
from tests.networks.test_routing import ROUTING
from tests.training.data.test_pairs import pair
from tests.training.synthetic.test_routes import route

CONFIG = ModelConfig(
    GraphConfig(max_points=100),
    REGION,
    MatchingConfig(TINY, layers=2, max_region=30),
    ROUTING,
    route_graph=GraphConfig(max_points=60),
)


@pytest.fixture(scope="module")
def shards(tmp_path_factory):
    folder = tmp_path_factory.mktemp("shards")
    for k in range(2):
        write_shard([pair(3 * k + i) for i in range(3)], folder / f"{k}.npz")
    return folder


@pytest.fixture(scope="module")
def routes(tmp_path_factory):
    folder = tmp_path_factory.mktemp("routes")
    write_routes([route(0), route(1)], folder / "0.npz")
    return folder


def config(shards, out, **changes):
    settings = dict(out=out, train=(shards,), steps=6, batch=2, warm_up=2, every=3, workers=0)
    return TrainConfig(**{**settings, **changes})


def weights(folder):
    return torch.load(folder / CHECKPOINT, weights_only=True)["model"]


def gradients(folder):
    state = torch.load(folder / CHECKPOINT, weights_only=True)["optimizer"]["state"]
    return [state[i]["exp_avg"] for i in sorted(state)]


def test_stopped_and_resumed_training_is_the_same_training(shards, tmp_path):
    whole = train(config(shards, tmp_path / "a"), CONFIG)
    first = train(config(shards, tmp_path / "b"), CONFIG, stop_at=2)
    second = train(config(shards, tmp_path / "b"), CONFIG)
    assert whole == first + second and len(whole) == 6
    a, b = weights(tmp_path / "a"), weights(tmp_path / "b")
    assert all(torch.equal(a[name], b[name]) for name in a)


def test_networks_learn_together_or_apart_and_are_resumed_bit_by_bit(shards, routes, tmp_path):
    together = {"routes": (routes,), "networks": ("region", "matching", "routing")}
    whole = train(config(shards, tmp_path / "a", **together), CONFIG)
    assert set(whole[0]) == {"focal", "dice", "spread", "matching", "routing"}
    first = train(config(shards, tmp_path / "b", **together), CONFIG, stop_at=2)
    assert whole == first + train(config(shards, tmp_path / "b", **together), CONFIG)
    apart = {"train": (), "routes": (routes,), "networks": ("routing",), "validate_routes": (routes,)}
    alone = train(config(shards, tmp_path / "c", **apart), CONFIG)
    assert [set(losses) for losses in alone] == [{"routing"}] * 6
    untouched, learned = weights(tmp_path / "c"), weights(tmp_path / "a")
    torch.manual_seed(0)
    for name, value in Model(CONFIG).state_dict().items():
        assert torch.equal(value, untouched[name]) == (not name.startswith("routing.")), name
        # The pairs show the same things twice, which says nothing about others.
        silent = name.startswith(("verification.", "region.spread."))
        assert silent or not torch.equal(value, learned[name]), name
    metrics = json.loads((tmp_path / "c" / LOG).read_text().splitlines()[-1])["validation"][routes.name]
    assert set(metrics) == {"routing", "routing_ordinary", "routing_mishaps"}


def test_training_begins_with_given_weights(shards, tmp_path):
    train(config(shards, tmp_path / "first", steps=2), CONFIG)
    # The rate is too small to change anything, so that the weights are those that it began with.
    train(config(shards, tmp_path / "next", weights=tmp_path / "first", learning_rate=1e-12), CONFIG)
    first, after = (load_model(tmp_path / name) for name in ("first", "next"))
    for (name, w), (_, there) in zip(first.named_parameters(), after.named_parameters(), strict=True):
        torch.testing.assert_close(w, there, atol=1e-6, rtol=1e-5, msg=name)
    with pytest.raises(CorruptData, match="shape"):
        train(config(shards, tmp_path / "third", weights=tmp_path / "first"), SMALL)


def test_a_checkpoint_gives_only_what_is_trained(shards, routes, tmp_path):
    """So that a network of another shape does not stop the others."""
    train(config(shards, tmp_path), CONFIG, stop_at=3)
    wider = replace(CONFIG, routing=replace(CONFIG.routing, width=16))
    before = weights(tmp_path)
    train(config(shards, tmp_path), wider, stop_at=4)
    assert load_model(tmp_path).config == wider
    assert not torch.equal(
        before["region.backbone.embed.0.weight"], weights(tmp_path)["region.backbone.embed.0.weight"]
    )


@pytest.mark.parametrize("network", ["region", "matching"])
def test_one_network_alone(shards, tmp_path, network):
    before = train(config(shards, tmp_path, networks=(network,)), CONFIG, stop_at=1)
    expected = {"region": {"focal", "dice", "spread"}, "matching": {"matching"}}
    assert set(before[0]) == expected[network]


def test_it_validates_logs_and_saves_weights_that_load(shards, tmp_path):
    train(config(shards, tmp_path, validate=(shards,), validation_pairs=3), CONFIG)
    records = [json.loads(line) for line in (tmp_path / LOG).read_text().splitlines()]
    assert [r["step"] for r in records] == [3, 6]
    assert set(records[0]["losses"]) == {"focal", "dice", "spread", "matching"}
    metrics = records[-1]["validation"][shards.name]
    assert all(0 <= value <= 1 for value in metrics.values()) and "region_iou" in metrics
    assert load_model(tmp_path).config == CONFIG


def test_a_damaged_checkpoint_is_named(shards, tmp_path):
    train(config(shards, tmp_path), CONFIG, stop_at=1)
    path = tmp_path / CHECKPOINT
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(CorruptData, match=CHECKPOINT):
        train(config(shards, tmp_path), CONFIG)


def test_nothing_to_train_on(tmp_path):
    with pytest.raises(InvalidInput, match="train"):
        train(config(tmp_path, tmp_path, train=()), CONFIG)
    with pytest.raises(InvalidInput, match="routes"):
        train(config(tmp_path, tmp_path, train=(), networks=("routing",)), CONFIG)
    with pytest.raises(InvalidInput, match="train"):
        train(config(tmp_path, tmp_path, routes=(tmp_path,), networks=("routing",)), CONFIG)
    with pytest.raises(CorruptData, match="shard"):
        train(config(tmp_path, tmp_path), CONFIG)


def test_samples_depend_on_their_number_alone(shards):
    dataset = PairDataset([shards], CONFIG, seed=0)
    (first,) = loader(dataset, [7], 1, 0)
    *_, again = loader(dataset, [3, 7], 1, 0)
    torch.testing.assert_close(first.query.points, again.query.points)


def test_schedule_warms_up_and_cools_down():
    values = [schedule(step, 10, 100) for step in range(101)]
    assert values[9] == 1 and values[100] == pytest.approx(0.01)
    assert all(a < b for a, b in pairwise(values[:10]))
    assert all(a >= b for a, b in pairwise(values[10:]))


@pytest.mark.parametrize("damage", ["card.json", "weights.safetensors"])
def test_damaged_weights_are_refused(tmp_path, damage):
    save_model(Model(CONFIG), tmp_path, {})
    assert load_model(tmp_path).config == CONFIG
    path = tmp_path / damage
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(CorruptData, match=str(tmp_path)):
        load_model(tmp_path)


def test_weights_of_another_shape_are_refused(tmp_path):
    save_model(Model(CONFIG), tmp_path, {})
    card = json.loads((tmp_path / "card.json").read_text())
    card["config"]["matching"]["layers"] = 3
    del card["config_sha256"]
    (tmp_path / "card.json").write_text(json.dumps(card))
    with pytest.raises(CorruptData, match="fit"):
        load_model(tmp_path)


WORKER = """
import sys
from pathlib import Path
from tests.training.loop.test_train import CONFIG, config
from imop.training.loop.train import train
train(config(Path(sys.argv[1]), Path(sys.argv[2]), batch=1, steps=1, precision="float32"), CONFIG)
"""


def test_two_processes_train_as_one(shards, tmp_path):
    """One step of two processes with a pair each is one step with both pairs, up to rounding."""
    train(config(shards, tmp_path / "one", steps=1, precision="float32"), CONFIG)
    (tmp_path / "worker.py").write_text(WORKER)
    root = Path(__file__).parents[3]
    paths = f"{root / 'src'}{os.pathsep}{root}"
    environment = {**os.environ, "PYTHONPATH": paths, "OMP_NUM_THREADS": "1", "LT_ACCELERATOR": "cpu"}
    torchrun = [sys.executable, "-m", "torch.distributed.run", "--standalone", "--nproc-per-node", "2"]
    command = [*torchrun, str(tmp_path / "worker.py"), str(shards), str(tmp_path / "two")]
    subprocess.run(command, env=environment, cwd=root, check=True, timeout=240)
    assert len((tmp_path / "two" / LOG).read_text().splitlines()) == 1
    # AdamW turns rounding of tiny gradients into whole steps, so its first moment is compared: the gradient.
    one, two = gradients(tmp_path / "one"), gradients(tmp_path / "two")
    for a, b in zip(one, two, strict=True):
        torch.testing.assert_close(a, b, atol=1e-6, rtol=1e-3)


def test_sources_are_drawn_by_their_shares(shards, tmp_path):
    with pytest.raises(InvalidInput, match="shares"):
        PairDataset([shards, shards], CONFIG, seed=0, shares=(1.0,))
    lone = tmp_path / "lone"
    lone.mkdir()
    write_shard([replace(pair(0), T_world_goal=se3.make(p=(0.0, 0.0, 5.0)))], lone / "0.npz")
    drawn = PairDataset([shards, lone], CONFIG, seed=0, shares=(1.0, 4.0))
    high = [float(drawn[i].poses[0, 2, 3]) > 3 for i in range(40)]
    assert 0.6 < np.mean(high) < 0.97
