from dataclasses import replace

import numpy as np
import pytest
import torch

from imop.baselines import policy
from imop.baselines.adapt import AdaptConfig, fine_tuned, tuned_adapters
from imop.baselines.hyper import HyperConfig, described, make_hyper_network, train_hyper
from imop.baselines.measure import measure
from imop.baselines.policy import make_regressor
from imop.baselines.train import RegressorConfig, train
from imop.baselines.weights import load_network, make_network
from imop.errors import AssetMissing, CorruptData, InvalidInput
from imop.geometry.perception import Perception
from tests.baselines.conftest import TINY, some_samples
from tests.demos.scenes import lift_a_cube

FEW = AdaptConfig(steps=2, batch=2)


def told(words="lift the cube"):
    return replace(lift_a_cube(), instructions=(words,)).stripped()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Weights of all methods, hardly trained."""
    where = tmp_path_factory.mktemp("baselines")
    samples = some_samples(6, 6)
    for kind in ("views", "points"):
        config = RegressorConfig(kind, (), where / kind, steps=2, batch=2, every=2, held_back=3)
        train(config, samples, shape=TINY[kind])
    train_hyper(HyperConfig(where / "views", (), where / "views_hdt", steps=2, batch=2, held_back=6), samples)
    return where


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(policy, "AdaptConfig", lambda: FEW)
    monkeypatch.setattr(policy, "ADAPTERS", FEW)


@pytest.mark.parametrize("method", policy.REGRESSORS)
def test_a_regressor_acts_the_same_whenever_it_is_asked(folder, method):
    acting = make_regressor(method, Perception(), folder)
    with pytest.raises(InvalidInput, match="watch"):
        acting.act(lift_a_cube().final)
    acting.watch(told())
    acting.reset()
    first, second = (acting.act(told().keyframes[0].observation) for _ in range(2))
    assert np.array_equal(first.T_world_gripper, second.T_world_gripper)
    assert np.abs(first.T_world_gripper[:3, 3] - (0.2, 0, 1.1)).max() < 0.7


def test_words_are_needed(folder):
    with pytest.raises(InvalidInput, match="instructions"):
        make_regressor("rvt", Perception(), folder).watch(replace(told(), instructions=()))


@pytest.mark.parametrize("method", ["rvt_ft", "rvt_hdt"])
def test_what_was_fitted_to_a_demonstration_is_used_again(folder, method, monkeypatch):
    fitting = make_regressor(method, Perception(), folder)
    fitting.watch(told("lift it once"))
    observation = told().keyframes[0].observation
    monkeypatch.setattr(policy.FineTuning, "_fit", None)
    again = make_regressor(method, Perception(), folder)
    again.watch(told("lift it once"))
    assert np.array_equal(fitting.act(observation).T_world_gripper, again.act(observation).T_world_gripper)
    plain = make_regressor("rvt", Perception(), folder)
    plain.watch(told("lift it once"))
    assert not np.array_equal(plain.act(observation).T_world_gripper, again.act(observation).T_world_gripper)


@pytest.mark.parametrize("method", ["rvt_ft", "rvt_hdt"])
def test_what_was_trained_is_not_fitted(folder, method, monkeypatch):
    monkeypatch.setattr(policy.FineTuning, "_fit", None)
    known = told(some_samples(1).instructions[0])
    acting, plain = make_regressor(method, Perception(), folder), make_regressor("rvt", Perception(), folder)
    for each in (acting, plain):
        each.watch(known)
    observation = known.keyframes[0].observation
    assert np.array_equal(acting.act(observation).T_world_gripper, plain.act(observation).T_world_gripper)


@pytest.mark.parametrize("method", policy.REGRESSORS)
def test_missing_weights_name_the_command(method, tmp_path):
    with pytest.raises(AssetMissing, match="imop baselines train"):
        make_regressor(method, Perception(), tmp_path)


def test_a_hyper_network_of_other_weights_is_refused(folder, tmp_path):
    train(
        RegressorConfig("views", (), tmp_path / "views", steps=1, batch=2),
        some_samples(),
        shape=TINY["views"],
    )
    (tmp_path / "views_hdt").symlink_to(folder / "views_hdt")
    with pytest.raises(CorruptData, match="other weights"):
        make_regressor("rvt_hdt", Perception(), tmp_path)


def test_a_new_hyper_network_changes_nothing():
    torch.manual_seed(0)
    network, samples = make_network("views", TINY["views"]).eval(), some_samples()
    keyframes = described(network, samples, np.arange(2))
    adapters = make_hyper_network(network)([keyframes])
    numbers = np.arange(2)
    assert measure(network, samples, numbers, 2) == measure(network, samples, numbers, 2, adapters)


def test_fitting_adapters_leaves_the_network_and_helps(folder):
    network, samples = load_network(folder / "views", "views")[0], some_samples(1, seed=5)
    before = {name: tensor.clone() for name, tensor in network.state_dict().items()}
    first = make_hyper_network(network)([described(network, samples, np.arange(1))])
    config = AdaptConfig(steps=25, batch=2, learning_rate=1e-2)
    adapters = tuned_adapters(network, samples, first, config)
    assert all(torch.equal(before[name], tensor) for name, tensor in network.state_dict().items())
    assert _loss(network, samples, adapters) < 0.97 * _loss(network, samples, first)
    tuned = fine_tuned(network, samples, config)
    assert _loss(tuned, samples, None) < 0.9 * _loss(network, samples, None)
    assert all(torch.equal(before[name], tensor) for name, tensor in network.state_dict().items())


@torch.no_grad()
def _loss(network, samples, adapters):
    from imop.baselines.batch import batch_of

    torch.manual_seed(0)
    return float(sum(network.loss(*batch_of(samples, np.zeros(8, int)), adapters).values()))


def test_a_hyper_network_resumes_where_it_was_stopped(folder, tmp_path):
    samples = some_samples(6, 6)
    whole = HyperConfig(folder / "views", (), tmp_path / "whole", steps=4, batch=2, every=2)
    parts = replace(whole, out=tmp_path / "parts")
    train_hyper(parts, samples, stop_at=2)
    first, second = (train_hyper(config, samples).state_dict() for config in (whole, parts))
    assert all(torch.equal(first[name], second[name]) for name in first)
