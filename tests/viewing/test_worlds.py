"""A recording goes on by keyframes and tells where the gripper went."""

from dataclasses import replace

import numpy as np

from imop.types import Demonstration, Keyframe
from imop.viewing.worlds import RecordedWorld
from tests.viewing.scenes import ACTIONS, demonstrated_scene

SEEN = demonstrated_scene().observation


def recorded():
    view = SEEN.views["top"]
    known = replace(view, instance_ids=np.ones(view.depth.shape, np.int32))
    steps = tuple(
        Keyframe(replace(SEEN, views={"top": known}, time_step=k), action) for k, action in enumerate(ACTIONS)
    )
    return Demonstration(steps, SEEN)


def test_each_action_is_followed_by_the_next_keyframe_and_the_last_ends_it():
    world = RecordedWorld(recorded())
    for k, action in enumerate(ACTIONS):
        assert world.observe().time_step == k
        assert np.array_equal(world.known(), action.T_world_gripper)
        assert world.perform(ACTIONS[0]).over == (k == len(ACTIONS) - 1)


def test_nobody_is_shown_what_only_a_simulator_knows():
    assert RecordedWorld(recorded()).observe().views["top"].instance_ids is None


def test_the_way_is_straight():
    way = RecordedWorld(recorded()).way(ACTIONS[1])
    assert np.array_equal(way, [SEEN.T_world_gripper[:3, 3], ACTIONS[1].T_world_gripper[:3, 3]])
