"""What is hidden is remembered; what is seen to be gone, near the hand's way, or inside the robot, is not."""

import numpy as np
import pytest

from imop.geometry.memory import hidden, with_hidden
from imop.types import Observation
from tests.policy.scenes import RED, TABLE, above, box, camera, concatenate, moved, table

HAND = above(0.4, 0.3, TABLE + 0.3)
WAY = np.stack([HAND[:3, 3], HAND[:3, 3]])
BOX = box((0.05, 0.05, 0.05), RED, np.eye(4))


def at_table(x, y):
    T = np.eye(4)
    T[:3, 3] = x, y, TABLE
    return moved(BOX, T)


def seen(depth):
    return Observation(
        {"top": camera(np.full((64, 64), depth, np.float32))}, HAND, 1.0, joint_positions=np.zeros(7)
    )


NEARER, TO_THE_TABLE = seen(0.5), seen(2 - TABLE)


def test_what_something_stands_before_is_remembered_with_its_colours():
    earlier = at_table(-0.2, 0.0)
    cloud = with_hidden(table(), NEARER, earlier, WAY, None)
    added = len(cloud) - len(table())
    assert 0.5 * len(earlier) < added <= len(earlier)
    assert (cloud.colors[len(table()) :] == np.float32(RED)).all()


def test_what_a_camera_sees_through_is_gone():
    assert len(with_hidden(table(), TO_THE_TABLE, at_table(-0.2, 0.0), WAY, None)) == len(table())


def test_one_camera_that_sees_a_place_is_enough():
    points = at_table(-0.2, 0.0).points
    both = Observation({"a": NEARER.views["top"], "b": TO_THE_TABLE.views["top"]}, HAND, 1.0)
    assert hidden(points, NEARER).all() and not hidden(points, both).any()


@pytest.mark.parametrize("depth", [np.nan, 0.0])
def test_where_nothing_was_measured_nothing_is_gone(depth):
    assert hidden(at_table(-0.2, 0.0).points, seen(depth)).all()


def test_what_is_seen_now_is_not_doubled():
    thing = at_table(-0.2, 0.0)
    cloud = concatenate([table(), thing])
    assert len(with_hidden(cloud, NEARER, thing, WAY, None)) == len(cloud)


def test_what_the_hand_passed_may_have_moved():
    way = np.array([[-0.5, 0.0, TABLE + 0.05], [0.5, 0.0, TABLE + 0.05]])
    cloud = with_hidden(table(), NEARER, at_table(-0.2, 0.0), way, None)
    beside = with_hidden(table(), NEARER, at_table(-0.2, 0.3), way, None)
    assert len(cloud) == len(table()) < len(beside)


def test_nothing_is_where_the_robot_is():
    def robot(points, joints, opening):
        return points[:, 0] < 0

    assert len(with_hidden(table(), NEARER, at_table(-0.2, 0.0), WAY, robot)) == len(table())
    assert len(with_hidden(table(), NEARER, at_table(0.2, 0.0), WAY, robot)) > len(table())
