import numpy as np
import pytest

from imop.geometry import se3
from imop.tasks.tabletop.cup_on_hook import CupOnHook
from imop.tasks.task import make_scene


@pytest.mark.parametrize(
    ("cup", "inwards", "up", "done"),
    [
        ("cup", 0.0, 0.0, True),
        ("cup", 0.05, 0.0, False),
        ("cup", 0.0, 0.06, False),
        ("other_cup", 0.0, 0.0, False),
    ],
)
def test_the_rod_has_to_pass_through_the_handle_of_the_right_cup(cup, inwards, up, done):
    task = CupOnHook()
    world = make_scene(task, 4, 0, 0)
    x_low, x_high, z_low, z_high = task.shape.loop
    middle = np.array([(x_low + x_high) / 2 - inwards, 0, (z_low + z_high) / 2 - up])
    R = se3.euler(z=-np.pi / 2)
    world.set_free_pose(f"{cup}/body", world.pose("stand/hook") @ se3.make(R, -R @ middle))
    assert task.success(world) == done


def test_a_rod_beside_the_handle_is_not_in_it():
    task = CupOnHook()
    world = make_scene(task, 4, 0, 0)
    x_low, x_high, z_low, z_high = task.shape.loop
    middle = np.array([(x_low + x_high) / 2, 0.12, (z_low + z_high) / 2])
    R = se3.euler(z=-np.pi / 2)
    world.set_free_pose("cup/body", world.pose("stand/hook") @ se3.make(R, -R @ middle))
    assert not task.success(world)
