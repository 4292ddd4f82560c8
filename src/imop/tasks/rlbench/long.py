"""Tasks with many steps: those of RLBench that are long anyway, and the longest variations of others alone.

`stack_blocks` and `place_cups` go through short and long variations in turn; here every scene is long.
"""

# ruff: noqa: D102 (the methods are described in Task)
from typing import Any

import numpy as np

from imop.tasks.rlbench.colors import NAMES
from imop.tasks.rlbench.place_cups import MUGS, PlaceCups
from imop.tasks.rlbench.stack_blocks import SIZES, StackBlocks


class StackFourBlocks(StackBlocks):
    """`StackBlocks` with four blocks; the variation is the colour."""

    name = "rlbench/stack_four_blocks"
    variations = len(NAMES)

    @classmethod
    def file(cls) -> str:
        return "stack_blocks"

    def instructions(self, variation: int) -> tuple[str, ...]:
        return super().instructions(_largest(variation))

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        super().build(spec, _largest(variation), rng)


class PlaceThreeCups(PlaceCups):
    """`PlaceCups` with three cups."""

    name = "rlbench/place_three_cups"
    variations = 1

    @classmethod
    def file(cls) -> str:
        return "place_cups"

    def instructions(self, variation: int) -> tuple[str, ...]:
        return super().instructions(len(MUGS) - 1)

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        super().build(spec, len(MUGS) - 1, rng)


def _largest(color: int) -> int:
    """Variation of `StackBlocks` with the tallest tower of a colour."""
    return color * len(SIZES) + len(SIZES) - 1
