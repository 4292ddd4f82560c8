from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from imop.demos.store import DemonstrationStore
from imop.errors import InvalidInput
from imop.geometry import se3
from imop.geometry.neighbours import nearest
from imop.training.data.shards import Shard
from imop.training.recorded import across, segmented
from imop.training.recorded.segmented import segment
from imop.training.recorded.write import RecordedConfig, groups, recorded_executions, write_recorded
from imop.types import Action, Demonstration, Keyframe
from tests.demos.scenes import Box, joints_for, observe


def group_pairs(takes):
    return [example.pair for example in segmented.group_pairs(takes)]


def other_pairs(first, second):
    return [example.pair for example in across.other_pairs(first, second)]


DOWN = se3.euler(x=np.pi)
HOME = se3.make(DOWN, (0.28, 0.0, 1.25))
BLOCK, PLATE = (0.05, 0.03, 0.04), (0.08, 0.06, 0.01)
ON_BLOCK, ON_PLATE = (se3.make(DOWN, (0, 0, z)) for z in (0.02, 0.12))
PLACES = [
    ((0.30, 0.10, 0.4), (0.10, -0.15, 0.3)),
    ((0.20, -0.20, 2.0), (0.35, 0.10, 0.2)),
    ((0.40, 0.00, -1.0), (0.15, 0.20, 1.2)),
]


@cache
def home_joints():
    return joints_for(HOME)


def at(place, half):
    return se3.make(se3.euler(z=place[2]), (*place[:2], 0.75 + half[2]))


@cache
def demonstration(number, hidden=False, half=BLOCK, instance=3):
    """Go to the block, then over the plate; the gripper is shown at home all the time."""
    block, plate = (at(p, size) for p, size in zip(PLACES[number], (half, PLATE), strict=True))
    boxes = [Box(block, half, (200, 40, 40), 10), Box(plate, PLATE, (40, 60, 200), 12)]
    cover = Box(block @ se3.make(p=(0, 0, 0.1)), (0.12, 0.12, 0.02), (90, 90, 90), 11)
    seen = [
        observe([*boxes, cover] if hidden else boxes, HOME, opening, step, wrist=False, q=home_joints())
        for step, opening in enumerate((1.0, 0.6, 0.6))
    ]
    keyframes = (
        Keyframe(seen[0], Action(block @ se3.make(p=(0, 0, half[2] - BLOCK[2])) @ ON_BLOCK, False)),
        Keyframe(seen[1], Action(plate @ ON_PLATE, True)),
    )
    return Demonstration(keyframes, seen[2], "test/carry", 0, (), {"instance": instance, "episode": number})


@cache
def takes():
    return tuple(segment(demonstration(number), None) for number in range(3))


def test_every_step_gives_a_pair_for_every_two_demonstrations():
    pairs = group_pairs(takes())
    assert len(pairs) == 2 * 3 * 2
    assert sum(p.gripper_open == (True, False) for p in pairs) == 6
    assert sum(p.gripper_open == (False, True) for p in pairs) == 6


def test_regions_are_what_the_actions_are_fixed_to_and_motions_are_true():
    for pair in group_pairs(takes()):
        step = int(pair.gripper_open == (False, True))
        number = next(i for i in range(3) if np.array_equal(takes()[i].goal(step), pair.T_world_goal))
        half, expected = ((BLOCK, ON_BLOCK), (PLATE, ON_PLATE))[step]
        thing = at(PLACES[number][step], half)
        np.testing.assert_allclose(pair.T_world_goal, thing @ expected)
        inside = np.abs(se3.apply(se3.invert(thing), pair.support.points)) < np.add(half, 0.004)
        assert not (pair.region & ~inside.all(axis=1)).any()
        assert (pair.region & inside.all(axis=1)).sum() > 0.8 * inside.all(axis=1).sum()
        moved = se3.apply(pair.T_query_support[0], pair.support.points[pair.region])
        # The two cameras see other sides of it.
        assert np.median(nearest(moved, pair.query.points)[0]) < 0.008


def test_an_oblong_thing_has_two_right_motions():
    pairs = group_pairs(takes())
    assert {len(p.T_query_support) for p in pairs} == {2}


LONGER = (0.09, 0.03, 0.04)


@cache
def others():
    return tuple(segment(demonstration(number, half=LONGER, instance=4), None) for number in (1, 2, 0))


def test_other_objects_are_paired_step_by_step_in_both_directions():
    pairs = other_pairs(takes(), others())
    aims = [(a.goal(step), b.goal(step)) for step in range(2) for a, b in zip(takes(), others(), strict=True)]
    expected = [aim for step in (aims[:3], aims[3:]) for aim in (*step, *((b, a) for a, b in step))]
    for pair, (shown, asked) in zip(pairs, expected, strict=True):
        np.testing.assert_array_equal(pair.T_world_goal, shown)
        np.testing.assert_allclose(pair.T_query_support[0] @ shown, asked, atol=1e-9)
        assert len(pair.T_query_support) == 2


def test_labels_say_where_the_other_object_is_longer():
    """The block's ends stick out of the shorter one by 4 cm; what one cannot see of it has no label."""
    # What is shown first comes first, step by step.
    shown = other_pairs(others(), takes())[:3]
    assert all(pair.gripper_open == (True, False) for pair in shown)
    for pair in shown:
        local = np.abs(se3.apply(se3.invert(pair.T_world_goal), pair.support.points)[:, 0])
        label, end = pair.invariance, pair.region & (local > 0.085)
        assert not np.isfinite(label[~pair.region]).any()
        assert np.nanmedian(label[pair.region & (local < 0.04)]) < 0.005
        assert np.nanmedian(label[end]) == pytest.approx(0.038, abs=0.012)
        assert np.isfinite(label[end]).mean() > 0.5


def test_another_step_gives_no_pair():
    """Where the action is fixed to another object, the demonstrations of the two do not call for the same."""
    swapped = [replace(t.demonstration, keyframes=t.demonstration.keyframes[::-1]) for t in others()]
    assert other_pairs(takes(), [segment(d, None) for d in swapped]) == []


def test_a_step_whose_object_is_hidden_gives_no_pair():
    hidden = segment(demonstration(2, hidden=True), None)
    pairs = group_pairs([*takes()[:2], hidden])
    blocked = [p for p in pairs if p.gripper_open == (True, False)]
    assert len(blocked) == 2 and len(pairs) == 2 + 6


def test_one_demonstration_has_no_pair():
    assert group_pairs(takes()[:1]) == []


@pytest.fixture
def store(tmp_path):
    made = DemonstrationStore.create(tmp_path / "demos.zarr")
    for number in range(3):
        made.append(demonstration(number))
    other = replace(demonstration(0), variation=1)
    for d in (other, replace(other, variation=2), replace(other, variation=2, seeds={"instance": 4})):
        made.append(d)
    return made


def test_groups_have_the_same_task_variation_and_objects(store):
    assert [sorted(group) for group in groups(store.aims(), 0)] == [[0, 1, 2]]


def test_shards_are_written_as_training_reads_them(store, tmp_path):
    assert write_recorded(RecordedConfig(store.path, tmp_path / "shards", 5)) == 5
    shard = Shard(tmp_path / "shards" / "shard-00000.npz")
    assert len(shard) == 5 and all(shard[i].region.any() for i in range(5))


def test_the_share_of_pairs_with_other_objects_is_met(store, tmp_path):
    for number in range(3):
        store.append(demonstration(number, half=LONGER, instance=4))
    assert write_recorded(RecordedConfig(store.path, tmp_path / "shards", 8, others=0.5)) == 8
    shard = Shard(tmp_path / "shards" / "shard-00000.npz")
    assert sum(shard[i].invariance is not None for i in range(8)) == 4


def test_executions_are_whole_and_come_with_how_another_task_begins(store):
    for number in range(3):
        store.append(demonstration(number, half=LONGER, instance=4))
    assert next(recorded_executions(store))[1] is None, "the store has one task only"
    store.append(replace(demonstration(0), task="test/other"))
    found = list(recorded_executions(store, others=0.5))
    assert len(found) > 6
    for group, elsewhere in found:
        assert [example.step for example in group] == [0, 1] and elsewhere.views
        assert len({(id(example.shown), id(example.asked)) for example in group}) == 1
        for example in group:
            to_recorded = se3.translation_distance(example.right_poses(), example.asked.goal(example.step))
            assert to_recorded.min() < 1e-6
    across = [g for g, _ in found if g[0].pair.invariance is not None]
    assert len(across) == pytest.approx(len(found) / 2, abs=1)


@pytest.mark.parametrize(("share", "field"), [(0.5, "store"), (1.5, "others"), (float("nan"), "others")])
def test_a_share_that_the_store_cannot_give_is_refused(store, tmp_path, share, field):
    with pytest.raises(InvalidInput, match=field):
        write_recorded(RecordedConfig(store.path, tmp_path / "shards", 5, others=share))


def test_what_belongs_to_nothing_is_refused(tmp_path):
    made = DemonstrationStore.create(tmp_path / "demos.zarr")
    made.append(demonstration(0))
    with pytest.raises(InvalidInput, match="scenes"):
        write_recorded(RecordedConfig(tmp_path / "demos.zarr", tmp_path / "shards", 5))
    with pytest.raises(InvalidInput, match="instance"):
        segment(demonstration(0).stripped(), None)
