"""Putting things on the table at random without overlap."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from imop.errors import ImopError
from imop.geometry import se3
from imop.sim.world import TABLE_HEIGHT, World
from imop.types import FloatArray

ANY_YAW = (-np.pi, np.pi)
CLEARANCE = 0.01
"""Between the footprints of different things, metres."""
_TRIES = 200

Circle = tuple[float, float, float]
"""(x, y, radius) in the frame of a body, metres."""


class NoRoom(ImopError):
    """The things of a scene could not be placed without overlap, or not within the arm's reach."""


@dataclass(frozen=True)
class Area:
    """Rectangle of the table (world frame, metres); by default what all cameras see well."""

    x: tuple[float, float] = (-0.02, 0.46)
    y: tuple[float, float] = (-0.38, 0.38)


@dataclass(frozen=True)
class Item:
    """A body to stand on the table.

    Attributes:
        body: its name.
        footprint: circles, in the body's frame, that nothing else may enter.
        height: of the body's origin above the table.
        area: where the origin may lie.
        yaw: range of its turn about z, radians.
    """

    body: str
    footprint: tuple[Circle, ...]
    height: float = 0.0
    area: Area = field(default_factory=Area)
    yaw: tuple[float, float] = ANY_YAW

    def sample(self, rng: np.random.Generator) -> FloatArray:
        """A random T_world_body (4, 4)."""
        x, y, yaw = rng.uniform(*self.area.x), rng.uniform(*self.area.y), rng.uniform(*self.yaw)
        return se3.make(se3.euler(z=yaw), (x, y, TABLE_HEIGHT + self.height))

    def circles(self, T_world_body: FloatArray) -> FloatArray:
        """The footprint on the table: (n, 3) x, y, radius."""
        circles = np.asarray(self.footprint)
        centres = se3.apply(T_world_body, np.column_stack([circles[:, :2], np.zeros(len(circles))]))
        return np.column_stack([centres[:, :2], circles[:, 2]])


ROBOT_FOOT: Circle = (-0.268, 0.0, 0.17)


def scatter(world: World, rng: np.random.Generator, items: Sequence[Item], taken: FloatArray) -> FloatArray:
    """Put `items`, in this order, where they overlap neither each other nor the circles `taken` (n, 3).

    Returns:
        (m, 3) all circles that are taken now.

    Raises:
        NoRoom: if an item finds no place.
    """
    for item in items:
        for _ in range(_TRIES):
            T = item.sample(rng)
            circles = item.circles(T)
            gaps = np.linalg.norm(circles[:, None, :2] - taken[None, :, :2], axis=2)
            if np.all(gaps > circles[:, None, 2] + taken[None, :, 2] + CLEARANCE):
                break
        else:
            raise NoRoom(f"{item.body}: no free place on the table in {_TRIES} tries")
        world.set_free_pose(item.body, T)
        taken = np.concatenate([taken, circles])
    return taken


def first_valid(world: World, name: str, draw: Callable[[], str], attempts: int) -> None:
    """Draw scenes, each from the present state, until one has no problem.

    Args:
        world: is left with the valid scene.
        name: of the task, for the error.
        draw: changes the world and says what is wrong with it, nothing if all is well.
        attempts: how often, at most.

    Raises:
        NoRoom: if no scene was valid.
    """
    untouched = world.save_state()
    problem = ""
    for _ in range(attempts):
        world.restore_state(untouched)
        try:
            problem = draw()
        except NoRoom as error:
            problem = str(error)
        if not problem:
            return
    raise NoRoom(f"{name}: no valid scene in {attempts} attempts; the last one: {problem}")
