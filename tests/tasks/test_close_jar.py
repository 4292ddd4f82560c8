import numpy as np
import pytest

from imop.geometry import se3
from imop.sim.parts.jar import DROP, TOP, TURN
from imop.tasks.tabletop.close_jar import CloseJar
from imop.tasks.task import make_scene


@pytest.fixture(scope="module")
def scene():
    task = CloseJar()
    return task, make_scene(task, 0, 0, 0)


@pytest.mark.parametrize(
    ("jar", "turn", "height", "done"),
    [
        ("jar", TURN, 0.0, True),
        ("jar", TURN + np.pi, 0.0, True),
        ("jar", 0.0, DROP, False),
        ("jar", TURN, DROP, False),
        ("jar", np.radians(20), 0.0, False),
        ("other0", TURN, 0.0, False),
    ],
)
def test_the_lid_has_to_be_down_and_turned_on_the_right_jar(scene, jar, turn, height, done):
    task, world = scene
    on = se3.make(se3.euler(z=-turn), (0, 0, TOP + height))
    world.set_free_pose("lid/body", world.pose(f"{jar}/body") @ on)
    assert task.success(world) == done
