"""Chains: the things, steps and aims of their parts, one after the other in one scene."""

import numpy as np
import pytest

from imop.geometry import se3
from imop.tasks.env import make_task
from imop.tasks.expert import record_demonstration
from imop.tasks.suites import SUITES, find_task
from imop.tasks.tabletop import CHAIN, CHAIN_NOVEL, NOVEL, TABLETOP
from imop.tasks.tabletop.chain import Chain
from imop.tasks.tabletop.press_buttons import PressButtons
from imop.tasks.tabletop.rubbish_in_bin import RubbishInBin
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.task import make_scene

CHAINS = {**CHAIN, **CHAIN_NOVEL}
every_chain = pytest.mark.parametrize("name", CHAINS)


class TwoBins(Chain):
    """The same part twice."""

    name = "two_bins"
    parts = (RubbishInBin, RubbishInBin)


class BinButtons(Chain):
    """Parts with one and with many variations."""

    name = "bin_buttons"
    parts = (RubbishInBin, PressButtons)


@pytest.fixture
def quick(monkeypatch):
    """Scenes are drawn once, whether or not the arm could work there."""
    monkeypatch.setattr(TableTask, "_problem", lambda task, world: "")


def test_chains_have_names_and_do_not_count_among_all():
    assert SUITES["tabletop"]["all"] == TABLETOP
    assert not set(TABLETOP) & set(CHAINS)
    assert all(find_task(name) is kind for name, kind in CHAINS.items())


def test_base_chains_are_made_of_no_novel_task_and_novel_ones_of_no_other():
    novel = set(NOVEL.values())
    assert not any(novel & set(chain.parts) for chain in CHAIN.values())
    assert all(novel >= set(chain.parts) for chain in CHAIN_NOVEL.values())


@every_chain
def test_there_is_a_step_for_each_of_the_parts_and_a_retreat_between_them(name, quick):
    chain = make_task(name)
    steps = len(chain.waypoints(make_scene(chain, chain.variations - 1, 0, 0))), chain.step_limit
    parts = [part() for part in CHAINS[name].parts]
    words = chain.instructions(chain.variations - 1)[0].split("; then ")
    alone = []
    for part, text in zip(parts, words, strict=True):
        variation = next(v for v in range(part.variations) if part.instructions(v)[0] == text)
        alone.append(len(part.waypoints(make_scene(part, variation, 0, 0))))
    assert steps[0] == sum(alone) + len(parts) - 1 <= steps[1]


def test_every_variation_of_every_part_occurs():
    task = BinButtons()
    assert task.variations == PressButtons.variations
    assert len({task.instructions(v) for v in range(task.variations)}) == task.variations


def test_things_of_different_parts_stand_apart(quick):
    chain = make_task("tabletop/chain_buttons_jar_cup")
    world = make_scene(chain, 0, 2, 2)
    circles = [item.circles(world.pose(item.body)) for item in chain.items()]
    for i, mine in enumerate(circles):
        for others in circles[:i]:
            gaps = np.linalg.norm(mine[:, None, :2] - others[None, :, :2], axis=2)
            assert np.all(gaps > mine[:, None, 2] + others[None, :, 2])


def test_all_aims_have_to_hold_at_the_end_and_a_part_may_occur_twice(quick):
    task = TwoBins()
    world = make_scene(task, 0, 3, 3)
    assert not task.success(world)
    lying = world.pose("0/paper/body")
    for k in range(2):
        world.set_free_pose(f"{k}/paper/body", world.pose(f"{k}/bin/body") @ se3.make(p=(0, 0, -0.06)))
        assert task.success(world) == (k == 1)
    world.set_free_pose("0/paper/body", lying)
    assert not task.success(world)


def test_one_demonstration_shows_the_whole():
    demonstration = record_demonstration(TwoBins(), 0)
    names = [keyframe.object_name or "" for keyframe in demonstration.keyframes]
    assert [name[0] for name in names] == 5 * ["0"] + 4 * ["1"]
    assert [k.action.gripper_open for k in demonstration.keyframes[3:6]] == [True, True, True]


def test_its_things_may_have_another_size(quick):
    usual, smaller = TwoBins(), TwoBins().resized(0.85)
    worlds = [make_scene(task, 0, 3, 3) for task in (usual, smaller)]
    heights = [w.pose("1/paper/body")[2, 3] - 0.75 for w in worlds]
    assert heights[1] == pytest.approx(0.85 * heights[0], rel=1e-6)
