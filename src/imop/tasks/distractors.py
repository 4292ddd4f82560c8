"""Further things beside those of a scene that is ready: they touch nothing and stand in nobody's way."""

from dataclasses import replace
from typing import Any

import numpy as np

from imop.geometry import se3
from imop.sim.parts.grocery import GROCERIES, grocery
from imop.sim.parts.shapes import add_to
from imop.sim.parts.solids import trinket
from imop.sim.world import TABLE_HEIGHT, World
from imop.tasks.clear import geoms_of, is_clear
from imop.tasks.colors import random_color
from imop.tasks.layout import Area, NoRoom
from imop.tasks.task import Task
from imop.types import FloatArray

_PREFIX = "distractor"
_PARKED = (4.0, 3.0)
"""On the floor, far from the table, until the scene is ready; metres."""
_CLEARANCE = 0.025
_HAND = 0.11
"""Half of the hand's width and some play."""
_TALLEST = 0.15
_TRIES = 400


def add_distractors(spec: Any, rng: np.random.Generator) -> None:
    """Add one or two household things to a scene, parked on the floor far away."""
    kinds = [kind for kind in GROCERIES if kind.height < _TALLEST]
    for i in range(int(rng.integers(1, 3))):
        if rng.random() < 0.3:
            shape = str(rng.choice(["bowl", "ball"]))
            part, height = trinket(shape, rng.uniform(0.03, 0.05), 0.05, random_color(rng)), 0.0
        else:
            kind = kinds[int(rng.integers(len(kinds)))]
            part, height = grocery(replace(kind, color=random_color(rng))), kind.height
        add_to(spec, f"{_PREFIX}{i}", part)
        spec.body(f"{_PREFIX}{i}/body").pos = (_PARKED[0], _PARKED[1] + 0.5 * i, height)


def place_distractors(task: Task, world: World, rng: np.random.Generator) -> None:
    """Bring what `add_distractors` added onto the table; nothing else moves.

    Args:
        task: of the scene; where its expert's hand goes must stay free.
        world: the scene.
        rng: decides where.

    Raises:
        NoRoom: if one finds no place.
    """
    way = np.stack([world.T_world_gripper[:3, 3], *(w.target(world)[:3, 3] for w in task.waypoints(world))])
    names = [world.model.body(i).name for i in range(world.model.nbody)]
    for name in names:
        if name.startswith(_PREFIX) and name.endswith("/body"):
            _place(world, name, way, rng)


def _place(world: World, name: str, way: FloatArray, rng: np.random.Generator) -> None:
    area, parked = Area(), world.pose(name)
    own, others = geoms_of(world, [world.model.body(name).id])
    for _ in range(_TRIES):
        x, y, yaw = rng.uniform(*area.x), rng.uniform(*area.y), rng.uniform(-np.pi, np.pi)
        if _distance_to_way(np.array([x, y]), way[:, :2]) < _HAND:
            continue
        world.set_free_pose(name, se3.make(se3.euler(z=yaw), (x, y, TABLE_HEIGHT + parked[2, 3])))
        if is_clear(world, own, others, _CLEARANCE):
            return
    raise NoRoom(f"{name}: no free place on the table in {_TRIES} tries")


def _distance_to_way(p: FloatArray, way: FloatArray) -> float:
    """Metres from a point (2,) to a polyline (n, 2)."""
    start, along = way[:-1], np.diff(way, axis=0)
    share = np.sum((p - start) * along, axis=1) / np.maximum(np.sum(along**2, axis=1), 1e-12)
    foot = start + np.clip(share, 0, 1)[:, None] * along
    return float(np.linalg.norm(p - foot, axis=1).min())
