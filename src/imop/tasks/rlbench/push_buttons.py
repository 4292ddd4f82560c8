"""Push buttons of given colours in a given order."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
import itertools
from collections.abc import Sequence

import numpy as np

from imop.geometry import se3
from imop.tasks.rlbench.colors import NAMES
from imop.tasks.rlbench.conditions import Condition, InOrder, JointMoved
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import DOWN, RLBenchTask, Step, carried

COLORS = tuple(name for name in NAMES if name not in ("red", "lime"))
COUNT, VARIATIONS = 3, 50
_ABOVE = 0.083


def sequence(variation: int) -> tuple[str, ...]:
    """Colours in the order in which their buttons must be pushed."""
    triples = itertools.permutations(COLORS, COUNT)
    return next(itertools.islice(triples, variation // COUNT, None))[: 1 + variation % COUNT]


class PushButtons(RLBenchTask):
    """Push one to three of the buttons from above with the closed gripper; others may be pushed, too."""

    name = "rlbench/push_buttons"
    told_by_color = True
    aims = tuple(" button, then the ".join(sequence(i)) for i in range(VARIATIONS))
    variations = VARIATIONS
    words = ("push the {} button", "press the {} button", "push down the {} button")

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        colors = sequence(self.variation)
        rest = [c for c in COLORS if c not in colors]
        bases = [*colors, *(str(c) for c in rng.choice(rest, COUNT - len(colors), replace=False))]
        room = self.boundary(scene, rng, "push_buttons_boundary")
        for i, color in enumerate(bases):
            scene.paint(f"push_buttons_target{i}", color)
            scene.paint(f"target_button_topPlate{i}", "red")
            scene.paint(f"target_button_wrap{i}", "red")
            room.sample(f"push_buttons_target{i}", min_distance=0.1)

    def steps(self, scene: Scene) -> Sequence[Step]:
        steps = []
        for i in range(len(sequence(self.variation))):
            base = f"push_buttons_target{i}"
            above = se3.make(DOWN, scene.pose(base)[:3, 3] + (0, 0, scene.scale * _ABOVE))
            steps += carried(scene, base, "waypoint0", above, ("waypoint0", "waypoint1"))
        return steps

    def conditions(self) -> Sequence[Condition]:
        count = len(sequence(self.variation))
        return [InOrder([JointMoved(f"target_button_joint{i}", 0.001) for i in range(count)])]
