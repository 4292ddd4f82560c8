import pytest

from imop.geometry import se3
from imop.sim.parts.peg import PLATE
from imop.tasks.tabletop.ring_on_peg import RingOnPeg
from imop.tasks.task import make_scene


@pytest.mark.parametrize(
    ("ring", "peg", "up", "beside", "done"),
    [
        ("ring", "peg", 0.0, 0.0, True),
        ("ring", "peg", 0.03, 0.0, False),
        ("ring", "peg", 0.0, 0.04, False),
        ("ring", "other_peg0", 0.0, 0.0, False),
        ("other_ring", "peg", 0.0, 0.0, False),
    ],
)
def test_the_ring_has_to_lie_around_the_peg_of_its_colour(ring, peg, up, beside, done):
    task = RingOnPeg()
    world = make_scene(task, 3, 0, 0)
    at = se3.make(p=(beside, 0, PLATE + up))
    world.set_free_pose(f"{ring}/body", world.pose(f"{peg}/body") @ at)
    assert task.success(world) == done
