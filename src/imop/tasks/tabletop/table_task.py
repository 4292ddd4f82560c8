"""Tasks whose things are scattered over the table, among clutter."""

# ruff: noqa: D102 (the methods are described in Task)
from abc import abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from imop.sim.world import World
from imop.tasks.checks import at_rest, overlaps, reachable, rehearse, settle
from imop.tasks.clutter import add_clutter, clutter_items
from imop.tasks.layout import ROBOT_FOOT, Item, first_valid, scatter
from imop.tasks.task import Task

_ATTEMPTS = 150


class TableTask(Task):
    """A task that says what is to be placed: without overlap, at rest, and within the arm's reach."""

    sizes: ClassVar[tuple[float, float] | None] = (0.85, 1.15)

    def resized(self, scale: float) -> Task:
        from imop.tasks.tabletop.resized import Resized  # which is a table task itself

        return Resized(self, scale)

    @abstractmethod
    def items(self) -> Sequence[Item]:
        """What has to be placed on the table, the largest first."""

    def arrange(self, world: World, rng: np.random.Generator) -> None:
        """Complete the scene after the items were placed (a lid onto its pot); nothing by default."""

    def furnish(self, spec: Any, rng: np.random.Generator) -> None:
        add_clutter(spec, rng)

    def reset(self, world: World, rng: np.random.Generator) -> None:
        def draw() -> str:
            self._place(world, rng)
            return self._problem(world)

        first_valid(world, self.name, draw, _ATTEMPTS)

    def _place(self, world: World, rng: np.random.Generator) -> None:
        taken = scatter(world, rng, self.items(), np.array([ROBOT_FOOT]))
        self.arrange(world, rng)
        scatter(world, rng, clutter_items(world), taken)

    def _problem(self, world: World) -> str:
        """What is wrong with the scene, or an empty string; settles the scene."""
        if touching := overlaps(world):
            return f"{touching} overlap"
        steps = self.waypoints(world)
        if not all(reachable(world, w.target(world), w.allow_collisions) for w in steps):
            return "a waypoint is out of reach"
        before = {item.body: world.pose(item.body) for item in (*self.items(), *clutter_items(world))}
        settle(world)
        if not at_rest(world, before) or overlaps(world):
            return "something moves by itself"
        return rehearse(world, steps)
