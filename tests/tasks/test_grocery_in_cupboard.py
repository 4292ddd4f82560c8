from dataclasses import replace

import numpy as np
import pytest

from imop.geometry import se3
from imop.sim.parts import cupboard
from imop.sim.parts.grocery import GROCERIES
from imop.tasks.tabletop.grocery_in_cupboard import GroceryInCupboard
from imop.tasks.task import make_scene

CRACKERS, TUNA = 0, 4


def lay(world, p, turn=-np.pi / 2):
    """Put the grocery, lying, bottom first, with the centre of its top at `p` of the cupboard."""
    world.set_free_pose("grocery/body", world.pose("cupboard/body") @ se3.make(se3.euler(y=-turn), p))


def test_grasps_are_the_same_for_every_grocery_and_the_widths_fit_the_hand():
    poses = []
    for variation in (CRACKERS, TUNA):
        task = GroceryInCupboard()
        world = make_scene(task, variation, 0, 0)
        poses.append([w.T_frame_gripper for w in task.waypoints(world)])
    assert np.allclose(*poses)
    assert all(kind.width < 0.07 for kind in GROCERIES)
    assert len({kind.name for kind in GROCERIES}) == 9


@pytest.mark.parametrize(
    ("p", "inside"),
    [((-0.05, 0, 0.1), True), ((0.02, 0, 0.1), False), ((-0.05, 0, 0.35), False), ((-0.05, 0.3, 0.1), False)],
)
def test_success_means_top_and_base_are_inside(p, inside):
    task = GroceryInCupboard()
    world = make_scene(task, TUNA, 1, 1)
    assert not task.success(world)
    lay(world, p)
    assert task.success(world) is inside


def test_the_longest_carton_fits_only_behind_the_opening():
    task = GroceryInCupboard()
    world = make_scene(task, CRACKERS, 2, 2)
    lay(world, (-0.01, 0, 0.1))
    assert task.success(world)
    task.kind = replace(task.kind, height=cupboard.DEPTH + 0.01)
    assert not task.success(world)
