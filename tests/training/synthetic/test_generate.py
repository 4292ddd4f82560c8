import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.training.data.shards import Shard
from imop.training.synthetic.families import HELD_OUT, TRAINING
from imop.training.synthetic.generate import GenerateConfig, chosen, generate


def test_families_are_chosen_by_name_and_no_names_mean_all():
    assert chosen((), False) == TRAINING and chosen((), True) == HELD_OUT
    assert list(chosen(("mug", "block"), False)) == ["block", "mug"]


@pytest.mark.parametrize("held_out", [False, True])
def test_a_family_of_the_other_set_is_refused_and_the_accepted_ones_named(tmp_path, held_out):
    own, other = (HELD_OUT, TRAINING) if held_out else (TRAINING, HELD_OUT)
    with pytest.raises(InvalidInput) as refusal:
        generate(GenerateConfig(tmp_path / "out", 1, held_out=held_out, families=(next(iter(other)),)))
    assert all(name in str(refusal.value) for name in own)
    assert not (tmp_path / "out").exists()


def test_a_mix_gives_labelled_pairs_and_a_wrong_one_is_refused_before_anything_is_made(tmp_path):
    generate(GenerateConfig(tmp_path / "mixed", 2, families=("block", "tray"), mix=(1, 0, 1, 0)))
    shard = Shard(tmp_path / "mixed" / "shard-00000.npz")
    assert sorted(shard[i].invariance is None for i in range(2)) == [False, True]
    with pytest.raises(InvalidInput, match="mix"):
        generate(GenerateConfig(tmp_path / "none", 2, mix=(0, 0, 0, 0)))
    assert not (tmp_path / "none").exists()


def test_naming_all_families_changes_nothing(tmp_path):
    for out, names in (("all", ()), ("named", tuple(reversed(TRAINING))), ("few", ("block", "drawers"))):
        generate(GenerateConfig(tmp_path / out, 1, families=names))
    default, named, few = (Shard(tmp_path / out / "shard-00000.npz")[0] for out in ("all", "named", "few"))
    np.testing.assert_array_equal(default.query.points, named.query.points)
    assert not np.array_equal(default.query.points, few.query.points)
