"""Build a pyramid of six blocks of a colour."""

# ruff: noqa: D102 (the methods are described in Task and RLBenchTask)
from collections.abc import Sequence
from types import MappingProxyType

import numpy as np

from imop.tasks.rlbench.colors import NAMES, others
from imop.tasks.rlbench.conditions import Condition, DetectedSeveral, NothingGrasped
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.task import RLBenchTask

BLOCKS = tuple(f"block_pyramid_block{i}" for i in range(6))
DISTRACTORS = tuple(f"block_pyramid_distractor_block{i}" for i in range(6))
ROWS = (3, 2, 1)
"""Blocks, from below."""


class BlockPyramid(RLBenchTask):
    """Three blocks in a row, two on these, one on top."""

    name = "rlbench/block_pyramid"
    sizes = (0.85, 1.0)
    told_by_color = True
    words = (
        "stack {} blocks in a pyramid",
        "create a pyramid with the {} objects",
        "make a pyramid out of {} cubes",
        "position the {} blocks in the shape of a pyramid",
        "use the {} blocks to build a pyramid",
    )
    step_limit = 50
    aims = NAMES
    variations = len(NAMES)
    yaw = (-np.pi / 8, np.pi / 8)
    graspable = (*BLOCKS, *DISTRACTORS)
    frames = MappingProxyType(
        {f"waypoint{6 * k + i}": "block_pyramid_plane" for k in range(len(BLOCKS)) for i in (3, 4, 5)}
    )

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        color = NAMES[self.variation]
        other = others(rng, color)[0]
        room = self.boundary(scene, rng, *(f"block_pyramid_boundary{i}" for i in range(4)))
        for block in (*BLOCKS, *DISTRACTORS):
            scene.paint(block, color if block in BLOCKS else other)
            room.sample(block, yaw=(-np.pi / 4, np.pi / 4), min_distance=0.08)

    def conditions(self) -> Sequence[Condition]:
        rows = [
            DetectedSeveral(BLOCKS, (f"block_pyramid_success_block{i}",), count)
            for i, count in enumerate(ROWS)
        ]
        return [*rows, NothingGrasped()]
