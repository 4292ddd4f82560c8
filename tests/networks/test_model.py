import json
import shutil

import pytest
import torch

from imop.errors import CorruptData
from imop.networks.model import BUNDLED, CARD, PAPER, SMALL, WEIGHTS, Model, load_model, save_model


def test_the_paper_size_has_80_8_million_parameters():
    with torch.device("meta"):
        total = sum(Model(PAPER).parameter_table().values())
    assert total == pytest.approx(80.8e6, rel=0.02)


def test_the_small_size_is_small():
    with torch.device("meta"):
        assert sum(Model(SMALL).parameter_table().values()) < 2e6


@pytest.fixture
def folder(tmp_path):
    shutil.copytree(BUNDLED, tmp_path / "weights")
    return tmp_path / "weights"


def with_config(folder, change, hashed=False):
    """The card after change(config), with or without the hash of the configuration before."""
    card = json.loads((folder / CARD).read_text())
    change(card["config"])
    if not hashed:
        del card["config_sha256"]
    (folder / CARD).write_text(json.dumps(card))


def test_what_is_saved_is_loaded(tmp_path):
    torch.manual_seed(0)
    saved = Model(SMALL)
    save_model(saved, tmp_path, {"seed": 0})
    loaded = load_model(tmp_path)
    assert loaded.config == SMALL
    for name, tensor in saved.state_dict().items():
        assert torch.equal(loaded.state_dict()[name], tensor)


def test_a_changed_configuration_is_noticed(folder):
    with_config(folder, lambda c: c["graph"].update(voxel=0.02), hashed=True)
    with pytest.raises(CorruptData, match=r"card\.json.*configuration"):
        load_model(folder)


def test_cards_written_before_the_configuration_had_a_hash_are_read(folder):
    with_config(folder, lambda c: None)
    assert load_model(folder).config == load_model().config


HUGE = 10**9


@pytest.mark.parametrize(
    "change",
    [
        lambda c: c["region"]["backbone"].update(group_width=0),
        lambda c: c["region"]["backbone"].update(group_width=-8),
        lambda c: c["region"]["backbone"].update(widths=[]),
        lambda c: c["region"]["backbone"].update(widths=[HUGE, HUGE, HUGE]),
        lambda c: c["matching"]["backbone"].update(depths=[1, HUGE, 1]),
        lambda c: c["matching"]["backbone"].update(depths=[1, HUGE, -HUGE]),
        lambda c: c["matching"].update(heads=0),
        lambda c: c["matching"].update(layers=HUGE),
        lambda c: c["region"].update(stages=HUGE),
        lambda c: c["routing"].update(width=HUGE),
        lambda c: c["routing"].update(layers="2"),
        lambda c: c.clear() or c.update(region=[]),
    ],
)
def test_absurd_configurations_are_corrupt_data(folder, change):
    """Before any memory is taken for them: 10^9 times 10^9 numbers fit nowhere."""
    with_config(folder, change)
    with pytest.raises(CorruptData):
        load_model(folder)


@pytest.mark.parametrize("card", ["", "[]", "null", "3", '"card"', "{", "[" * 100_000])
def test_cards_that_are_none(folder, card):
    (folder / CARD).write_text(card)
    with pytest.raises(CorruptData, match=r"card\.json"):
        load_model(folder)


@pytest.mark.parametrize("file", [CARD, WEIGHTS])
def test_missing_files_and_pointers_of_git_lfs(folder, file):
    (folder / file).write_text("version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n")
    with pytest.raises(CorruptData, match=rf"{file}.*git lfs pull"):
        load_model(folder)
    (folder / file).unlink()
    with pytest.raises(CorruptData, match=rf"{file}.*missing"):
        load_model(folder)
