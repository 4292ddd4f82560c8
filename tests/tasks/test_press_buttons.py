import itertools

import pytest

from imop.tasks.tabletop.press_buttons import PressButtons, sequence
from imop.tasks.task import make_scene

THREE = 1
"""A variation with three presses."""


@pytest.fixture(scope="module")
def scene():
    task = PressButtons()
    world = make_scene(task, THREE, 0, 0)
    return task, world, world.save_state()


def press(world, button):
    cap = world.model.body(f"button{button}/cap").id
    world.data.xfrc_applied[cap, 2] = -10
    world.step(150)
    world.data.xfrc_applied[cap, 2] = 0
    world.step(150)


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_only_the_right_order_succeeds(scene, order):
    task, world, start = scene
    world.restore_state(start)
    for button in order:
        assert not task.success(world)
        press(world, button)
    assert task.success(world) == (order == (0, 1, 2))


@pytest.mark.parametrize("when", range(4))
def test_another_button_spoils_it(scene, when):
    task, world, start = scene
    world.restore_state(start)
    presses = [0, 1, 2]
    presses.insert(when, 3)
    for button in presses:
        press(world, button)
    assert not task.success(world)


def test_a_sequence_has_no_colour_twice():
    sequences = [sequence(variation) for variation in range(PressButtons.variations)]
    assert all(len(set(s)) == len(s) for s in sequences)
    assert len(set(sequences)) == len(sequences)
