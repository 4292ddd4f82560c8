"""A task of one's own; in this folder `imop run --task my_task:LiftBlock` performs it."""

from imop.sim.parts.shapes import add_to
from imop.sim.parts.solids import block
from imop.tasks.grasps import backed_off, from_above, shifted
from imop.tasks.layout import Item
from imop.tasks.tabletop.table_task import TableTask
from imop.tasks.waypoint import Waypoint


class LiftBlock(TableTask):
    """Grasp a block from above and lift it. Done when it is held well above the table."""

    graspable = ("block/body",)

    def instructions(self, variation):
        """The aim in words."""
        return ("lift the block", "pick the block up")

    def build(self, spec, variation, rng):
        """Draw shape and colour; the frame of a block is the centre of its upper face."""
        self.size = (rng.uniform(0.06, 0.1), 0.045, rng.uniform(0.04, 0.06))
        add_to(spec, "block", block(self.size, rng.uniform(0.1, 0.9, 3)))

    def items(self):
        """What is placed on the table at random: body, circles (x, y, radius) that stay free, height."""
        return [Item("block/body", ((0, 0, 0.08),), self.size[2])]

    def waypoints(self, world):
        """Above the block, down to it with open fingers, which then close, and up."""
        grasp = from_above((0, 0, -0.02))
        return [
            Waypoint("block/body", backed_off(grasp, 0.1), gripper_open=True),
            Waypoint("block/body", grasp, gripper_open=False, allow_collisions=True, linear=True),
            Waypoint("block/body", shifted(grasp, (0, 0, 0.15)), False, allow_collisions=True),
        ]

    def success(self, world):
        """Asked after every motion."""
        return "block/body" in world.held and world.pose("block/body")[2, 3] > 0.85
