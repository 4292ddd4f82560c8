"""The recipe's commands fit together, and the card says what was done."""

import json
import re
import shlex
from pathlib import Path

import pytest
import torch
import tyro
from rich.console import Console

from imop.cli import main
from imop.errors import InvalidInput
from imop.networks.model import load_model
from imop.training.config import TrainConfig
from imop.training.data.route_shards import write_routes
from imop.training.data.shards import write_shard
from imop.training.recipes import recipe
from imop.training.recipes.commands import Stage
from imop.training.recipes.merge import MergeConfig
from imop.training.recipes.recipe import RECIPES, make, stages
from imop.training.verification.cases import CasesConfig
from imop.training.verification.fit import VerificationTraining
from tests.training.data.test_pairs import pair
from tests.training.synthetic.test_routes import route

OUT = Path("/some where/small")
CONFIGS = {
    "train": TrainConfig,
    "training cases": CasesConfig,
    "training merge": MergeConfig,
    "training verification": VerificationTraining,
}


def words(stage):
    return shlex.split(stage.command)


def configs(name, jobs):
    """The configuration of every stage that is made of one, by the stage's name."""
    found = {}
    for stage in stages(RECIPES[name], OUT, jobs):
        given = words(stage)
        command, arguments = given[given.index("imop.cli") + 1], given[given.index("imop.cli") + 2 :]
        if command == "training":
            command, arguments = f"training {arguments[0]}", arguments[1:]
        if command in CONFIGS:
            found[stage.name] = tyro.cli(CONFIGS[command], args=arguments)
    return found


@pytest.fixture(autouse=True)
def no_gpu(monkeypatch):
    monkeypatch.setattr(torch.cuda, "device_count", lambda: 0)


@pytest.mark.parametrize("name", RECIPES)
def test_every_stage_that_draws_has_a_seed_of_its_own_below_1000(name):
    seeds = {s.name: re.findall(r"--seed (\d+)", s.command) for s in stages(RECIPES[name], OUT, 2)}
    assert seeds.pop("merged") == []
    assert all(len(found) == 1 and int(found[0]) < 1000 for found in seeds.values())
    assert len({found[0] for found in seeds.values()}) == len(seeds)


@pytest.mark.parametrize("name", RECIPES)
def test_what_a_stage_reads_was_made_before_it(name):
    there = set()
    for stage in stages(RECIPES[name], OUT, 2):
        given = words(stage)
        out = given[given.index("--out") + 1]
        named = {word for word in given if word.startswith(str(OUT))}
        assert named - {out} <= there, stage.name
        there.add(out)
        assert (OUT / stage.makes).is_relative_to(out) or stage.name == "demonstrations"
    assert str(OUT) == out and stage.makes == "card.json", "the last one writes the weights"


@pytest.mark.parametrize("name", RECIPES)
def test_what_is_held_out_is_never_seen(name):
    for stage in stages(RECIPES[name], OUT, 2):
        assert "--held-out" not in words(stage)
        assert "collect" not in words(stage) or "--split base" in stage.command


@pytest.mark.parametrize("jobs", [1, 2, 3, 4, 8])
def test_every_step_has_the_same_samples_on_any_number_of_processes(jobs):
    small = RECIPES["small"]
    for name, batch in (("region_and_matching", small.batch), ("routing", small.routing_batch)):
        stage = next(s for s in stages(small, OUT, jobs) if s.name == name)
        processes = int(words(stage)[words(stage).index("--nproc-per-node") + 1])
        assert processes <= jobs and processes * configs("small", jobs)[name].batch == batch


def test_the_networks_are_trained_and_searched_with_as_planned():
    small, found = RECIPES["small"], configs("small", 2)
    both, routing = found["region_and_matching"], found["routing"]
    assert set(both.networks) == {"region", "matching"} and both.steps == small.steps
    assert [p.name for p in both.train] == ["pairs", "recorded"] and both.shares == small.shares
    assert routing.networks == ("routing",) and routing.steps == small.routing_steps
    assert (found["merged"].pairs, found["merged"].routing) == (both.out, routing.out)
    assert found["first_cases"].weights == found["verification"].weights == found["merged"].out
    assert found["cases"].weights == found["first_verification"].out
    assert found["cases"].mix == found["first_cases"].mix == small.mix
    assert found["recorded_cases"].weights == found["first_verification"].out
    assert found["recorded_cases"].store == OUT / "demonstrations.zarr"
    made = ("first_cases", "cases", "recorded_cases")
    assert found["verification"].cases == tuple(found[name].out for name in made)


def test_a_folder_belongs_to_one_recipe(tmp_path, monkeypatch):
    monkeypatch.setattr(recipe, "run", lambda *_: None)
    monkeypatch.setattr(recipe, "_complete_card", lambda *_: None)
    make("trial", tmp_path, 1, Console(quiet=True))
    make("trial", tmp_path, 2, Console(quiet=True))
    with pytest.raises(InvalidInput, match="another recipe"):
        make("small", tmp_path, 1, Console(quiet=True))


def test_the_card_says_what_was_done(tmp_path, monkeypatch):
    """With stages that only pretend: shards are there, and a card and a report are written."""
    for folder, count in (("pairs", 2), ("recorded", 1)):
        write_shard([pair(i) for i in range(count)], tmp_path / "shards" / folder / "0.npz")
    write_routes([route(0)], tmp_path / "shards" / "routes" / "0.npz")
    report = {"episodes": {"tabletop/open_drawer": 3}}
    pretended = [
        Stage(name, name, f"-c {shlex.quote(f'open({str(tmp_path / name)!r}, {mode!r}).write({text!r})')}")
        for name, mode, text in (
            ("demonstrations.json", "w", json.dumps(report)),
            ("card.json", "w", json.dumps({"verification": {"right": 0.5}})),
        )
    ]
    monkeypatch.setattr(recipe, "stages", lambda *_: pretended)
    for _ in range(2):  # the second time everything is done
        make("trial", tmp_path, 1, Console(quiet=True))
        card = json.loads((tmp_path / "card.json").read_text())
        assert card["verification"] == {"right": 0.5} and card["recipe"] == "trial"
        assert card["commands"] == {stage.name: f"python {stage.command}" for stage in pretended}
        counts = {"pairs": 2, "recorded": 1, "routes": 1, "demonstrations": report["episodes"]}
        assert card["counts"] == counts


@pytest.mark.slow
def test_the_trial_from_nothing_to_weights(tmp_path, capsys):
    for time in range(2):
        with pytest.raises(SystemExit) as stopped:
            main(["train", "--recipe", "trial", "--out", str(tmp_path / "a b"), "--jobs", "2"])
        said = capsys.readouterr().out
        assert stopped.value.code == 0, said
        assert said.count("done before") == time * len(stages(RECIPES["trial"], OUT, 2))
    load_model(tmp_path / "a b")
    card = json.loads((tmp_path / "a b" / "card.json").read_text())
    assert {card["parts"][name]["step"] for name in ("region_and_matching", "routing")} == {2}
    assert card["counts"]["pairs"] == 4 and 0 <= card["verification"]["right"] <= 1
