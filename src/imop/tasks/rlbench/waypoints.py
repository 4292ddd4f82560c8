"""Waypoints as the files have them: numbered objects with words."""

import re
from dataclasses import dataclass

import numpy as np

from imop.geometry import se3
from imop.tasks.coppelia.model import Model, PathObject, SceneObject, Shape
from imop.types import FloatArray

_GRIPPER = re.compile(r"(open|close)_gripper\(\s*([0-9.]*)\s*\)")
OPEN = 0.9
"""Opening from which the gripper counts as open."""
_PATH_STEP, _PATH_TURN = 0.12, np.radians(30.0)
"""Along a curve one step reaches so far, at most."""


@dataclass(frozen=True)
class Words:
    """What the extension string of a waypoint says.

    Attributes:
        ignore_collisions: whether the motion may touch things.
        linear: whether only a straight line will do.
        opening: of the gripper afterwards, 0 closed .. 1 open; None for that before.
    """

    ignore_collisions: bool
    linear: bool
    opening: float | None


def read_words(extension: str) -> Words:
    """The meaning of an extension string."""
    opening = None
    for word, amount in _GRIPPER.findall(extension):
        opening = float(amount or word == "open")
    return Words("ignore_collision" in extension, "linear" in extension, opening)


def numbered(model: Model) -> list[str]:
    """waypoint0, waypoint1, ... as far as there are such objects."""
    names: list[str] = []
    while f"waypoint{len(names)}" in model.index:
        names.append(f"waypoint{len(names)}")
    return names


def path_poses(path: PathObject, scale: float = 1.0) -> FloatArray:
    """(n, 4, 4) poses along a curve, in its frame, close enough to be reached one after another.

    There are as many at every `scale` of the curve.
    """
    points = path.T_path_points
    chosen, last = [], points[0]
    for i, T in enumerate(points[1:], start=1):
        ahead = points[min(i + 1, len(points) - 1)]
        far = se3.translation_distance(last, ahead) > scale * _PATH_STEP
        if far or se3.rotation_distance(last, ahead) > _PATH_TURN or i == len(points) - 1:
            chosen.append(T)
            last = T
    return np.stack(chosen)


def thing_of(model: Model, name: str) -> str:
    """The shape on which an object hangs; the uppermost object if there is none, or only a boundary."""
    o: SceneObject = model[name]
    while o.parent >= 0:
        o = model.objects[o.parent]
        if isinstance(o, Shape) and "boundary" not in o.name:
            return o.name
    return o.name
