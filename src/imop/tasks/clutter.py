"""Things on the table that no task needs."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from imop.sim.parts.shapes import add_to
from imop.sim.parts.solids import SHAPES, trinket
from imop.sim.world import World
from imop.tasks.colors import random_color
from imop.tasks.layout import Item

_PREFIX = "clutter"
_LARGEST = 0.034


def add_clutter(spec: Any, rng: np.random.Generator, most: int = 4, shapes: Sequence[str] = SHAPES) -> None:
    """Add two to `most` things of random size and colour, each of one of the `shapes`."""
    for i in range(int(rng.integers(2, most + 1))):
        shape = str(rng.choice(shapes))
        radius, height = rng.uniform(0.018, _LARGEST), rng.uniform(0.03, 0.09)
        add_to(spec, f"{_PREFIX}{i}", trinket(shape, radius, height, random_color(rng)))


def clutter_items(world: World) -> list[Item]:
    """What `add_clutter` added, to be placed."""
    names = [world.model.body(i).name for i in range(world.model.nbody)]
    return [Item(name, ((0, 0, _LARGEST),)) for name in names if name.startswith(_PREFIX)]
