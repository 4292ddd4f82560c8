import numpy as np
import pytest

from imop.tasks.tabletop.turn_faucet import TurnFaucet
from imop.tasks.task import make_scene


@pytest.mark.parametrize(("variation", "side", "other"), [(0, "left", "right"), (1, "right", "left")])
def test_only_the_handle_of_the_variation_counts(variation, side, other):
    task = TurnFaucet()
    world = make_scene(task, variation, 3, 3)
    world.set_joint(f"faucet/{other}", np.pi / 2)
    assert not task.success(world)
    world.set_joint(f"faucet/{side}", np.pi / 2)
    assert not task.success(world), "both were turned"
    world.set_joint(f"faucet/{other}", 0.0)
    assert task.success(world)
