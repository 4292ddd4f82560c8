"""A suite and a method of one's own: `imop eval --suite my_suite:SUITE --methods my_suite:Repeat,expert`."""

from imop import Action
from my_task import LiftBlock

SUITE = {"novel": {"lift_block": LiftBlock}}
"""Split -> name -> task. The split "all" is made of the others."""


class Repeat:
    """Repeats the demonstrated motions, whatever it sees."""

    def watch(self, demonstration):
        """Remember one demonstration."""
        self.actions = [keyframe.action for keyframe in demonstration.keyframes]

    def reset(self):
        """Begin a new episode."""
        self.step = 0

    def act(self, observation):
        """The next action."""
        shown = self.actions[min(self.step, len(self.actions) - 1)]
        self.step += 1
        return Action(shown.T_world_gripper, shown.gripper_open, shown.allow_collisions)
