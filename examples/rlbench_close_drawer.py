"""A task of one's own from a model file of RLBench: push a drawer shut, in the scene of open_drawer.ttm.

In this folder: imop run --task rlbench_close_drawer:CloseDrawer
"""
# ruff: noqa: D102 (the methods are described in RLBenchTask)

from imop.tasks.rlbench.conditions import JointMoved
from imop.tasks.rlbench.task import RLBenchTask

LEVELS = ("bottom", "middle", "top")


class CloseDrawer(RLBenchTask):
    """Grip the handle of the drawer that stands open, and push."""

    name = "own/close_drawer"
    words = ("close the {} drawer", "push the {} drawer shut")
    aims = LEVELS
    variations = len(LEVELS)
    yaw = (-0.39, 0.39)

    @classmethod
    def file(cls):
        return "open_drawer"

    def init_episode(self, scene, rng):
        level = LEVELS[self.variation]
        self.joint, self.opened = f"drawer_joint_{level}", rng.uniform(0.10, 0.18)
        p_shut = scene.pose(f"waypoint_anchor_{level}")[:3, 3]
        scene.world.set_joint(self.joint, self.opened)
        scene.move_to("waypoint1", f"waypoint_anchor_{level}")  # waypoint0 and waypoint2 hang on it
        scene.move("waypoint2", p_shut)
        self.frames = dict.fromkeys(("waypoint0", "waypoint1"), f"drawer_{level}")

    def conditions(self):
        return [JointMoved(self.joint, self.opened - 0.02)]


SUITE = {"novel": {"close_drawer": CloseDrawer}}
