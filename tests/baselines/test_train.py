import json

import numpy as np
import pytest
import torch

from imop.baselines.measure import measure
from imop.baselines.train import RegressorConfig, train
from imop.baselines.weights import load_network
from imop.errors import AssetMissing, CorruptData, InvalidInput
from tests.baselines.conftest import TINY, some_samples


def config(kind, out, **changed):
    return RegressorConfig(
        **{
            "network": kind,
            "stores": (),
            "out": out,
            "steps": 6,
            "batch": 2,
            "every": 3,
            "warm_up": 2,
            **changed,
        }
    )


def test_stopped_and_resumed_training_gives_the_same_weights(kind, tmp_path):
    samples = some_samples(4, 4)
    train(config(kind, tmp_path / "whole"), samples, shape=TINY[kind])
    train(config(kind, tmp_path / "parts"), samples, stop_at=3, shape=TINY[kind])
    train(config(kind, tmp_path / "parts"), samples, shape=TINY[kind])
    whole, parts = (load_network(tmp_path / n, kind)[0].state_dict() for n in ("whole", "parts"))
    assert all(torch.equal(whole[name], parts[name]) for name in whole)


def test_a_tiny_network_learns_one_sample(kind, tmp_path):
    samples = some_samples(1)
    steps = config(kind, tmp_path, steps=150, batch=4, learning_rate=3e-3, every=150, ema=0.9)
    losses = train(steps, samples, shape=TINY[kind])
    assert np.mean(losses[-10:]) < 0.75 * np.mean(losses[:10])
    found = measure(load_network(tmp_path, kind)[0], samples, np.arange(1), 1)
    assert found["place"] < 0.06 and found["gripper"] == found["collisions"] == 1


def test_held_back_demonstrations_are_not_learnt(tmp_path):
    train(config("views", tmp_path, held_back=2), some_samples(6, 4), shape=TINY["views"])
    _, card = load_network(tmp_path, "views")
    assert card["samples"] == 6 and card["samples_learnt"] == 4 and card["demonstrations"] == 4
    log = [json.loads(line) for line in (tmp_path / "log.jsonl").read_text().splitlines()]
    assert [line["step"] for line in log] == [3, 6] and set(log[-1]["validation"]) >= {"place", "rotation"}


def test_missing_weights_name_the_command_that_makes_them(kind, tmp_path):
    with pytest.raises(AssetMissing, match=f"baselines.train --network {kind}"):
        load_network(tmp_path, kind)


def test_damaged_weights_are_refused(tmp_path):
    train(config("views", tmp_path), some_samples(), shape=TINY["views"])
    with pytest.raises(CorruptData, match="kind views"):
        load_network(tmp_path, "points")
    (tmp_path / "weights.safetensors").write_bytes(b"short")
    with pytest.raises(CorruptData):
        load_network(tmp_path, "views")


def test_numbers_out_of_range_are_refused(tmp_path):
    with pytest.raises(InvalidInput, match="batch"):
        train(config("views", tmp_path, batch=0), some_samples())
