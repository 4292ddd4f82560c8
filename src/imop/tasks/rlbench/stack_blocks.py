"""Stack blocks of a colour."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence

import numpy as np

from imop.geometry import se3
from imop.tasks.rlbench.colors import NAMES, others
from imop.tasks.rlbench.conditions import Condition, DetectedSeveral, NothingGrasped
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import DOWN, RLBenchTask, Step, carried

SIZES = (2, 3, 4)
BLOCKS = tuple(f"stack_blocks_target{i}" for i in range(4))
DISTRACTORS = tuple(f"stack_blocks_distractor{i}" for i in range(4))
_FIRST, _EACH = 0.13, 0.06


class StackBlocks(RLBenchTask):
    """Build a tower on the green base."""

    name = "rlbench/stack_blocks"
    sizes = (0.85, 1.0)
    told_by_color = True
    aims = tuple(f"{size} {color}" for color in NAMES for size in SIZES)
    variations = len(NAMES) * len(SIZES)
    words = (
        "stack {} blocks",
        "place {} cubes on top of each other",
        "pick up and set down {} blocks on top of each other",
        "build a tall tower out of {} cubes",
        "arrange {} blocks in a vertical stack on the table top",
        "set {} cubes on top of each other",
    )
    graspable = (*BLOCKS, *DISTRACTORS)

    @property
    def height(self) -> int:
        """How many blocks the variation stacks."""
        return SIZES[self.variation % len(SIZES)]

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        color = NAMES[self.variation // len(SIZES)]
        other = others(rng, color)[0]
        room = self.boundary(scene, rng, *(f"stack_blocks_boundary{i}" for i in range(4)))
        for block in (*BLOCKS, *DISTRACTORS):
            scene.paint(block, color if block in BLOCKS else other)
            room.sample(block, min_distance=0.1)

    def steps(self, scene: Scene) -> Sequence[Step]:
        steps: list[Step] = []
        base = "stack_blocks_target_plane"
        for k, block in enumerate(BLOCKS[: self.height]):
            x, y = scene.pose(block)[:2, 0]
            grasp = se3.make(se3.euler(z=float(np.arctan2(y, x))) @ DOWN, scene.pose(block)[:3, 3])
            T_above = scene.pose("waypoint3")
            up = scene.scale * (_FIRST + _EACH * k)
            above = se3.make(T_above[:3, :3], scene.pose(base)[:3, 3] + (0, 0, up))
            last = k == self.height - 1
            steps += carried(scene, block, "waypoint1", grasp, ("waypoint0", "waypoint1", "waypoint2"))
            after = ("waypoint3", "waypoint4") if last else ("waypoint3", "waypoint4", "waypoint5")
            steps += carried(scene, base, "waypoint3", above, after)
        return steps

    def conditions(self) -> Sequence[Condition]:
        return [
            DetectedSeveral(BLOCKS, ("stack_blocks_success",), self.height),
            NothingGrasped(),
        ]
