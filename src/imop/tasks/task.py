"""What a task is: a scene, an aim that the simulator can check, and an expert's waypoints."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar, Protocol

import numpy as np

from imop.errors import InvalidInput
from imop.sim.arms import PANDA, Arm
from imop.sim.gripper import PERIOD_STEPS, OnFrame
from imop.sim.world import World, allow_grasp, scene_spec
from imop.tasks.waypoint import Waypoint

_EXTRA_PERIODS = 10
"""Of 0.05 simulated seconds."""


class Task(ABC):
    """A kind of scene and an aim. `build` makes one instance of it, which the other methods then speak about.

    Attributes:
        name: "suite/name"; of one's own task, what it was called by.
        variations: how many aims there are (which drawer, which colour).
        step_limit: how many actions an episode may take.
        insist: whether a motion that would touch something is made all the same if there is no other.
        graspable: bodies that the gripper may attach.
        one_instance: whether its things are the same in every instance.
        told_by_color: whether the things acted on are told from others by their colours, which then must
            stay as they were demonstrated.
        sizes: smallest and largest scale of its things, see `resized`; None if they have one size only.
    """

    name: str = ""
    variations: int = 1
    step_limit: int = 25
    insist: bool = False
    graspable: tuple[str, ...] = ()
    one_instance: ClassVar[bool] = False
    told_by_color: ClassVar[bool] = False
    sizes: ClassVar[tuple[float, float] | None] = None

    @classmethod
    def available(cls) -> bool:
        """Whether all files that the task needs are there."""
        return True

    def resized(self, scale: float) -> "Task":
        """The task with all its things at `scale` times their size.

        Raises:
            InvalidInput: if they have one size only.
        """
        raise InvalidInput("scale", f"{scale} for {self.name}", "a task with `sizes`")

    @abstractmethod
    def instructions(self, variation: int) -> tuple[str, ...]:
        """The aim in words, the usual wording first."""

    @abstractmethod
    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        """Add the task's objects to `spec`; `rng` decides shapes, sizes and colours."""

    def furnish(self, spec: Any, rng: np.random.Generator) -> None:  # noqa: B027 (optional)
        """Add what differs from scene to scene and the task does not need; nothing by default."""

    def prepare(self, world: World) -> None:  # noqa: B027 (optional)
        """Say of the compiled scene what its bodies do not, such as what is one thing; nothing by default."""

    @abstractmethod
    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Place everything at random so that the expert can begin.

        Raises:
            NoRoom: if no such scene was found in a bounded number of attempts.
        """

    @abstractmethod
    def waypoints(self, world: World) -> Sequence[Waypoint]:
        """The expert's steps, always as many for a variation. Step k is read when steps before k are done."""

    def watch(self, world: World) -> None:  # noqa: B027 (optional)
        """See, every 0.05 simulated seconds, what the aim depends on later; nothing by default."""

    @abstractmethod
    def success(self, world: World) -> bool:
        """Whether the aim is reached now."""


class SceneChange(Protocol):
    """What is changed in a scene while it is made, after what its seeds say."""

    def furnish(self, spec: Any) -> None:
        """Add what the task does not know, away from its place: it must not disturb `Task.reset`."""

    def finish(self, task: Task, world: World) -> None:
        """Change the scene that was reset.

        Raises:
            NoRoom: if something found no place.
        """


def watching(task: Task, on_frame: OnFrame | None) -> OnFrame:
    """What to call every 0.05 simulated seconds so that the task and somebody else can watch."""

    def watch(world: World) -> None:
        task.watch(world)
        if on_frame is not None:
            on_frame(world)

    return watch


def wait(task: Task, world: World, watch: OnFrame) -> bool:
    """Let go on what rolls or falls after the last step, as RLBench does; whether the aim is reached."""
    for _ in range(_EXTRA_PERIODS):
        if task.success(world):
            return True
        world.step(PERIOD_STEPS)
        watch(world)
    return task.success(world)


def make_scene(
    task: Task,
    variation: int,
    instance_seed: int,
    seed: int,
    change: SceneChange | None = None,
    arm: Arm = PANDA,
) -> World:
    """The scene of one episode: same arguments, same scene.

    Args:
        task: is built by this call.
        variation: number of the aim.
        instance_seed: decides shapes, sizes and colours of the task's objects.
        seed: decides poses and clutter.
        change: of this scene, if any.
        arm: that stands in it.

    Raises:
        InvalidInput: if the task has no such variation.
        NoRoom: if the objects could not be placed.
    """
    if not 0 <= variation < task.variations:
        raise InvalidInput("variation", f"{variation}", f"0 .. {task.variations - 1} for {task.name}")
    spec = scene_spec(arm)
    task.build(spec, variation, np.random.default_rng((instance_seed, variation)))
    task.furnish(spec, np.random.default_rng((seed, 1)))
    if change is not None:
        change.furnish(spec)
    for body in task.graspable:
        allow_grasp(spec, body)
    world = World(spec, arm)
    task.prepare(world)
    task.reset(world, np.random.default_rng((seed, 2)))
    if change is not None:
        change.finish(task, world)
    return world
