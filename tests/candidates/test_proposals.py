"""What a thing is, and which turns of it change nothing."""

import numpy as np
import pytest

from imop.candidates.proposals import equal_turns, thing_of
from imop.geometry import se3
from imop.geometry.cloud import concatenate
from tests.policy.scenes import BLUE, RED, at, box
from tests.policy.test_symmetry import can

SIZE = (0.1, 0.05, 0.06)
HERE = at(0.1, 0.1)


def test_the_thing_of_a_part_is_all_that_is_connected_to_it():
    one, other = box(SIZE, RED, HERE), box(SIZE, BLUE, at(0.4, 0.1))
    standing = concatenate([one, other]).points
    assert len(thing_of(one.points[:20], standing)) == len(one)
    assert thing_of(one.points, standing[:0]) is one.points


def angles(cloud):
    turns = equal_turns(cloud)
    assert np.array_equal(turns[0], np.eye(4))
    return np.degrees(se3.rotation_distance(turns, np.eye(4))).round()


def test_a_can_looks_the_same_in_every_turn():
    assert len(angles(can())) == 8


def test_a_cube_looks_the_same_in_four_turns():
    assert sorted(angles(box((0.06, 0.06, 0.06), RED, HERE))) == [0, 90, 90, 180]


@pytest.mark.parametrize("size", [(0.12, 0.03, 0.04), (0.2, 0.1, 0.02)])
def test_half_a_turn_alone_is_not_trusted(size):
    assert list(angles(box(size, RED, HERE))) == [0]
