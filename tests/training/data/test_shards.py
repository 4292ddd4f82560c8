from dataclasses import replace

import numpy as np
import pytest

from imop.errors import CorruptData
from imop.training.data.pairs import Carry
from imop.training.data.shards import Shard, write_shard
from tests.networks.scenes import tabletop
from tests.networks.test_networks import GOAL, NOW
from tests.training.data.test_pairs import pair


def test_round_trip(tmp_path):
    first, second = pair(0), pair(1)
    shared = replace(second, support=first.support, region=first.region)
    write_shard([first, shared, second], tmp_path / "a.npz")
    shard = Shard(tmp_path / "a.npz")
    assert len(shard) == 3
    for wrote, read in zip((first, shared, second), (shard[i] for i in range(3)), strict=True):
        for name in ("support", "after", "query"):
            a, b = getattr(wrote, name), getattr(read, name)
            np.testing.assert_allclose(a.points, b.points, atol=1e-6)
            np.testing.assert_allclose(a.colors, b.colors, atol=0.5 / 255 + 1e-6)
            np.testing.assert_allclose(a.normals, b.normals, atol=0.02)
        np.testing.assert_array_equal(wrote.region, read.region)
        np.testing.assert_allclose(wrote.T_query_support, read.T_query_support)
        np.testing.assert_allclose(wrote.T_world_goal, read.T_world_goal)
        np.testing.assert_allclose(wrote.T_world_now, read.T_world_now)
        assert wrote.gripper_open == read.gripper_open


def test_labels_of_other_instances_are_kept_and_equal_ones_stay_without(tmp_path):
    equal = pair()
    label = np.where(equal.region, np.linspace(0, 0.08, len(equal.region)), np.nan)
    write_shard([equal, replace(equal, invariance=label)], tmp_path / "a.npz")
    shard = Shard(tmp_path / "a.npz")
    assert shard[0].invariance is None
    np.testing.assert_allclose(shard[1].invariance, label, atol=1e-4)


def test_the_next_carry_is_kept_and_none_stays_none(tmp_path):
    hands = np.stack([GOAL, NOW])
    first, second = pair(0), replace(pair(1), carry=Carry(tabletop(7), hands))
    write_shard([first, second], tmp_path / "a.npz")
    without, read = Shard(tmp_path / "a.npz")[0].carry, Shard(tmp_path / "a.npz")[1].carry
    assert without is None and read is not None
    np.testing.assert_allclose(read.after.points, tabletop(7).points, atol=1e-6)
    np.testing.assert_allclose(read.T_world_hand, hands)


def test_shared_clouds_are_stored_once(tmp_path):
    write_shard([pair()], tmp_path / "one.npz")
    one = pair()
    write_shard([one, replace(one, gripper_open=(False, False))], tmp_path / "two.npz")
    small, large = ((tmp_path / name).stat().st_size for name in ("one.npz", "two.npz"))
    assert large < 1.1 * small


@pytest.mark.parametrize("damage", [lambda b: b[: len(b) // 2], lambda b: b"", lambda b: b"PK" + b[2:40]])
def test_a_damaged_shard_is_named(tmp_path, damage):
    path = tmp_path / "a.npz"
    write_shard([pair()], path)
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(CorruptData, match=r"a\.npz"):
        Shard(path)


def test_a_shard_with_pickles_is_refused(tmp_path):
    np.savez(tmp_path / "a.npz", version=np.array([print], dtype=object))
    with pytest.raises(CorruptData, match=r"a\.npz"):
        Shard(tmp_path / "a.npz")
