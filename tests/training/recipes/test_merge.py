"""Networks that were trained separately become one model."""

import json
from dataclasses import replace

import pytest
import torch

from imop.errors import CorruptData
from imop.networks.model import CARD, WEIGHTS, Model, load_model, save_model
from imop.training.recipes.merge import MergeConfig, merge
from tests.training.loop.test_train import CONFIG


@pytest.fixture
def folders(tmp_path):
    """Pairs and routing; the routing network of the first has another shape."""
    torch.manual_seed(0)
    other = replace(CONFIG, routing=replace(CONFIG.routing, width=16), route_graph=CONFIG.graph)
    save_model(Model(other), tmp_path / "pairs", {"seed": 1})
    save_model(Model(CONFIG), tmp_path / "routing", {"seed": 2})
    return tmp_path


def test_every_network_comes_from_its_folder(folders):
    merge(MergeConfig(folders / "out", folders / "pairs", folders / "routing"))
    merged, parts = load_model(folders / "out"), {f: load_model(folders / f) for f in ("pairs", "routing")}
    assert merged.config == CONFIG
    for name, value in merged.state_dict().items():
        source = parts["routing" if name.startswith("routing.") else "pairs"]
        assert torch.equal(value, source.state_dict()[name])
    card = json.loads((folders / "out" / CARD).read_text())
    assert {part["seed"] for part in card["parts"].values()} == {1, 2}


def test_what_does_not_fit_is_refused(folders):
    (folders / "pairs" / WEIGHTS).write_bytes((folders / "routing" / WEIGHTS).read_bytes()[:100])
    with pytest.raises(CorruptData, match="pairs"):
        merge(MergeConfig(folders / "out", folders / "pairs", folders / "routing"))
    (folders / "pairs" / CARD).unlink()
    with pytest.raises(CorruptData, match=CARD):
        merge(MergeConfig(folders / "out", folders / "pairs"))
