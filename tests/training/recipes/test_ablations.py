"""Every row of the paper's ablations is trained alike, and becomes weights that the policy runs with."""

import shlex
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from imop.networks.model import BUNDLED, SMALL, Model, load_model, save_model
from imop.policy.paper import PaperMatcher
from imop.training.ablation import Ablation
from imop.training.recipes.ablations import ROWS, AblationsConfig, stages
from imop.training.recipes.merge import MergeConfig, merge

CONFIG = AblationsConfig(Path("a folder"), (Path("pairs"),), (Path("routes"),), (Path("held"),))


def options(stage):
    return shlex.split(stage.command)


def test_rows_differ_in_their_row_alone():
    trained = {s.name: options(s) for s in stages(CONFIG) if s.name.endswith("_networks")}
    assert {name.removesuffix("_networks") for name in trained} == set(ROWS)
    reference = trained["small_networks"]
    for name, command in trained.items():
        row = name.removesuffix("_networks")
        own = shlex.split(ROWS[row])
        assert command == [word.replace("/small", f"/{row}") for word in reference] + own


def test_what_is_not_asked_for_is_not_trained():
    names = [s.name for s in stages(replace(CONFIG, rows=("k4",)))]
    assert names == ["routing", "routing_no_low_dimensional", "k4_networks", "k4"]


def test_without_the_robots_state_routing_does_not_see_it_either():
    last = {s.name: options(s) for s in stages(CONFIG)}["no_low_dimensional"]
    assert last[last.index("--routing") + 1].endswith("routing_no_low_dimensional")


@pytest.mark.parametrize("ablation", [Ablation(pose="from_matches"), Ablation(pose="regressed"), Ablation()])
def test_merged_weights_keep_the_pose_and_take_the_verification(tmp_path, ablation):
    torch.manual_seed(0)
    save_model(Model(ablation.of(SMALL)), tmp_path / "pairs", {})
    merge(MergeConfig(tmp_path / "out", tmp_path / "pairs", BUNDLED, BUNDLED))
    merged, pairs, bundled = (load_model(p) for p in (tmp_path / "out", tmp_path / "pairs", BUNDLED))
    assert merged.config.pose == pairs.config.pose
    for name, value in merged.state_dict().items():
        source = bundled if name.startswith(("routing.", "verification.")) else pairs
        assert torch.equal(value, source.state_dict()[name]), name
    assert PaperMatcher(merged).model.routing.trained
