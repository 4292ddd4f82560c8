"""What a task is: a scene, an aim that the simulator can check, and an expert's waypoints."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from imop.errors import InvalidInput
from imop.sim.world import World, allow_grasp, scene_spec
from imop.tasks.checks import at_rest, overlaps, reachable, rehearse, settle
from imop.tasks.clutter import add_clutter, clutter_items
from imop.tasks.layout import ROBOT_FOOT, Item, NoRoom, scatter
from imop.tasks.waypoint import Waypoint

_ATTEMPTS = 150


class Task(ABC):
    """A kind of scene and an aim. `build` makes one instance of it, which the other methods then speak about.

    Attributes:
        name: "suite/name".
        variations: how many aims there are (which drawer, which colour).
        graspable: bodies that the gripper may attach.
    """

    name: ClassVar[str]
    variations: ClassVar[int] = 1
    graspable: tuple[str, ...] = ()

    @abstractmethod
    def instructions(self, variation: int) -> tuple[str, ...]:
        """The aim in words, the usual wording first."""

    @abstractmethod
    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        """Add the task's objects to `spec`; `rng` decides shapes, sizes and colours."""

    @abstractmethod
    def items(self) -> Sequence[Item]:
        """What has to be placed on the table, the largest first."""

    def arrange(self, world: World, rng: np.random.Generator) -> None:  # noqa: B027 (optional)
        """Complete the scene after the items were placed (a lid onto its pot); nothing by default."""

    @abstractmethod
    def waypoints(self, world: World) -> Sequence[Waypoint]:
        """The expert's steps, always as many for a variation. Step k is read when steps before k are done."""

    @abstractmethod
    def success(self, world: World) -> bool:
        """Whether the aim is reached now."""

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Place everything at random: nothing overlaps, all is at rest, the arm reaches every waypoint.

        Raises:
            NoRoom: if no such scene was found in a bounded number of attempts.
        """
        untouched = world.save_state()
        problem = ""
        for _ in range(_ATTEMPTS):
            world.restore_state(untouched)
            try:
                self._place(world, rng)
            except NoRoom as error:
                problem = str(error)
                continue
            problem = self._problem(world)
            if not problem:
                return
        raise NoRoom(f"{self.name}: no valid scene in {_ATTEMPTS} attempts; the last one: {problem}")

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


def make_scene(task: Task, variation: int, instance_seed: int, seed: int) -> World:
    """The scene of one episode: same arguments, same scene.

    Args:
        task: is built by this call.
        variation: number of the aim.
        instance_seed: decides shapes, sizes and colours of the task's objects.
        seed: decides poses and clutter.

    Raises:
        InvalidInput: if the task has no such variation.
        NoRoom: if the objects could not be placed.
    """
    if not 0 <= variation < task.variations:
        raise InvalidInput("variation", f"{variation}", f"0 .. {task.variations - 1} for {task.name}")
    spec = scene_spec()
    task.build(spec, variation, np.random.default_rng((instance_seed, variation)))
    add_clutter(spec, np.random.default_rng((seed, 1)))
    for body in task.graspable:
        allow_grasp(spec, body)
    world = World(spec)
    task.reset(world, np.random.default_rng((seed, 2)))
    return world
