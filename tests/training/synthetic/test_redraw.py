"""Another thing of a kind: the same structure and colours in other sizes."""

import numpy as np
import pytest

from imop.errors import ImopError
from imop.geometry import se3
from imop.training.synthetic.families import HELD_OUT, TRAINING
from imop.training.synthetic.families.redraw import Diverged, alike, differ, redrawn
from imop.training.synthetic.families.thing import from_above

EVERY = TRAINING | HELD_OUT


def drawn(name, shape=0, color=1):
    return EVERY[name](np.random.default_rng(shape), np.random.default_rng(color))


@pytest.mark.parametrize("name", list(EVERY))
def test_every_family_has_another_thing_of_the_same_structure(name):
    first, other = drawn(name), redrawn(EVERY[name], 0, 1, 2)
    assert alike(first, other) and differ(first, other)
    colors = [thing.part.compile().geom_rgba for thing in (first, other)]
    np.testing.assert_array_equal(*colors)
    for a, b in zip(first.holds, other.holds, strict=True):
        assert a.link == b.link
        assert se3.rotation_distance(a.T_link_gripper, b.T_link_gripper) < np.radians(10)


def test_other_colours_do_not_change_the_sizes():
    one, other = (redrawn(TRAINING["mug"], 0, color, 2).part.compile() for color in (1, 5))
    np.testing.assert_array_equal(one.geom_size, other.geom_size)
    assert not np.array_equal(one.geom_rgba, other.geom_rgba)


def test_the_seed_of_the_sizes_decides():
    sizes = [redrawn(TRAINING["mug"], 0, 1, seed).part.compile().geom_size for seed in (2, 2, 3)]
    np.testing.assert_array_equal(sizes[0], sizes[1])
    assert not np.array_equal(sizes[0], sizes[2])


def test_a_door_keeps_its_side_and_its_handle():
    for shape in range(6):
        first, other = drawn("door", shape).part.compile(), redrawn(TRAINING["door"], shape, 1, 9)
        np.testing.assert_array_equal(first.jnt_axis, other.part.compile().jnt_axis)
        assert first.ngeom == other.part.compile().ngeom


def test_what_turns_is_turned_as_far_as_the_first():
    first, other = drawn("knob"), redrawn(TRAINING["knob"], 0, 1, 2)
    assert [m.positions for m in first.moving] == [m.positions for m in other.moving]
    for moving in redrawn(TRAINING["drawers"], 0, 1, 2).moving:
        assert 0 <= min(moving.positions) < max(moving.positions)


def test_a_family_whose_decisions_depend_on_sizes_has_no_other_thing():
    def moody(shape, color):
        thing = drawn("block", 3)
        shape.integers(1, 2 + int(1e6 * shape.uniform(1.0, 2.0)))
        return thing

    with pytest.raises(Diverged) as refusal:
        redrawn(moody, 0, 1, 2)
    assert isinstance(refusal.value, ImopError)


def test_things_held_from_other_sides_are_of_another_structure():
    def block(yaw):
        thing = drawn("block")
        object.__setattr__(thing.holds[0], "T_link_gripper", from_above((0, 0, 0.02), yaw))
        return thing

    assert alike(block(0.0), block(0.1)) and not alike(block(0.0), block(1.0))
