import numpy as np
import pytest

from imop.geometry import se3
from imop.sim.parts.cabinet import HANDLE_OUT
from imop.tasks.tabletop.item_in_drawer import PULL, ItemInDrawer
from imop.tasks.task import make_scene


@pytest.fixture(scope="module")
def scene():
    task = ItemInDrawer()
    return task, make_scene(task, 1, 0, 0)


@pytest.mark.parametrize(
    ("drawer", "behind_the_front", "up", "done"),
    [
        (1, 0.06, 0.0, True),
        (1, -0.05, 0.0, False),
        (1, 0.06, 0.15, False),
        (2, 0.06, 0.0, False),
    ],
)
def test_the_item_has_to_be_in_the_right_drawer(scene, drawer, behind_the_front, up, done):
    task, world = scene
    for i in range(3):
        world.set_joint(f"cabinet/drawer{i}", PULL if i == drawer else 0.0)
    assert not task.success(world)
    p = np.array([-HANDLE_OUT - behind_the_front, 0, task.size[2] - 0.03 + up])
    before = world.pose("item/body")
    world.set_free_pose("item/body", world.pose(f"cabinet/drawer{drawer}") @ se3.make(p=p))
    assert task.success(world) == done
    world.set_free_pose("item/body", before)


def test_the_drawers_are_closed_at_the_start():
    task = ItemInDrawer()
    world = make_scene(task, 2, 1, 1)
    assert all(abs(world.joint(f"cabinet/drawer{i}")) < 0.002 for i in range(3))
