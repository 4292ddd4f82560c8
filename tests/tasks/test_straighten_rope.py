import numpy as np

from imop.geometry import se3
from imop.sim.parts.rope import bend
from imop.sim.world import TABLE_HEIGHT
from imop.tasks.tabletop.straighten_rope import StraightenRope
from imop.tasks.task import make_scene


def test_the_rope_must_lie_straight_with_each_end_on_the_mark_of_its_colour():
    task = StraightenRope()
    world = make_scene(task, 0, 3, 3)
    bend(world, "rope", task.rope, np.zeros(task.rope.links - 1))
    T_world_mark = world.pose("mark0/body")
    for turn, start, reached in ((1, 0.0, True), (-1, task.rope.length, False)):
        T = T_world_mark @ se3.make(se3.euler(z=turn * np.pi / 2), (0, start, 0))
        T[2, 3] = TABLE_HEIGHT + task.rope.radius
        world.set_free_pose("rope/body", T)
        assert task.success(world) == reached, "the ends are exchanged" if turn < 0 else "straight"
