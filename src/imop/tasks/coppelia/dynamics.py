"""Which parts of a model move, on what, and which of them pass through each other."""

from itertools import combinations

import numpy as np

from imop.geometry import se3
from imop.tasks.coppelia.model import ForceSensor, Joint, Model, Shape
from imop.types import FloatArray

_LOCAL, _GLOBAL = 0x00FF, 0xFF00


def is_free(model: Model, i: int) -> bool:
    """Whether object `i` is a dynamic shape that nothing holds, wherever in the tree it stands."""
    o = model.objects[i]
    if not (isinstance(o, Shape) and o.dynamic):
        return False
    return o.parent < 0 or not isinstance(model.objects[o.parent], Joint | ForceSensor)


def is_moving_joint(model: Model, i: int) -> bool:
    """Whether object `i` is a joint that forces move: it is dynamic, and so is a shape on it."""
    o = model.objects[i]
    below = (model.objects[k] for k in model.children[i])
    return isinstance(o, Joint) and o.dynamic and any(isinstance(c, Shape) and c.dynamic for c in below)


def carrier(model: Model, i: int) -> int:
    """What `i` moves rigidly with: itself or an ancestor that is free or a moving joint; -1 for none."""
    while i >= 0 and not (is_free(model, i) or is_moving_joint(model, i)):
        i = model.objects[i].parent
    return i


def carried(model: Model, i: int) -> list[int]:
    """All that hangs on object `i` whatever joints do, and `i` itself; free shapes below it do not."""
    below = (k for child in model.children[i] if not is_free(model, child) for k in carried(model, child))
    return [i, *below]


def passing_pairs(model: Model) -> list[tuple[str, str]]:
    """Names of respondable shapes that go through each other where a collision would stop them.

    Shapes that a joint or force sensor connects, and shapes of one tree whose masks share no bit of the low
    byte.
    """
    solid = [i for i, o in enumerate(model.objects) if isinstance(o, Shape) and o.respondable]
    pairs = []
    for a, b in combinations(solid, 2):
        if carrier(model, a) == carrier(model, b):
            continue  # never collide
        if _linked(model, a, b) or _linked(model, b, a) or not _masks_meet(model, a, b):
            pairs.append((model.objects[a].name, model.objects[b].name))
    return pairs


def _linked(model: Model, child: int, parent: int) -> bool:
    link = model.objects[child].parent
    return link >= 0 and isinstance(model.objects[link], Joint) and model.objects[link].parent == parent


def _masks_meet(model: Model, a: int, b: int) -> bool:
    p, q = model.objects[a], model.objects[b]
    assert isinstance(p, Shape) and isinstance(q, Shape)
    same_tree = _tree(model, a) == _tree(model, b)
    return bool(p.mask & q.mask & (_LOCAL if same_tree else _GLOBAL))


def _tree(model: Model, i: int) -> int:
    """What a shape hangs on in the end: the next static shape or other fixed thing above it, or its root."""
    while True:
        o = model.objects[i]
        moving = isinstance(o, Joint | ForceSensor) or (isinstance(o, Shape) and o.dynamic)
        if not moving or o.parent < 0:
            return i
        i = o.parent


def joint_inertia(model: Model, i: int, mass: dict[int, tuple[float, FloatArray]]) -> float:
    """What joint `i` has to move: kg for a prismatic one, else kg m2 about its axis or origin.

    Args:
        model: the model.
        i: index of the joint.
        mass: of every dynamic shape, with its principal moments (3,).
    """
    joint = model.objects[i]
    T_joint_world = se3.invert(model.T_world_moved[i])
    total = 0.0
    for k in carried(model, i):
        if k not in mass:
            continue
        shape, (m, moments) = model.objects[k], mass[k]
        assert isinstance(joint, Joint) and isinstance(shape, Shape)
        T = T_joint_world @ model.T_world_moved[k] @ shape.T_shape_inertia
        if joint.kind == "prismatic":
            total += m
        elif joint.kind == "revolute":
            total += m * float(T[0, 3] ** 2 + T[1, 3] ** 2) + float(moments @ T[2, :3] ** 2)
        else:
            total += m * float(T[:3, 3] @ T[:3, 3]) + float(np.mean(moments))
    return total
