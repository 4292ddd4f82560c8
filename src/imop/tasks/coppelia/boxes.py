"""Bounding boxes, as the program reckons them: RLBench finds room for models by these."""

import numpy as np

from imop.geometry import se3
from imop.sim.world import World
from imop.tasks.coppelia.model import Dummy, Joint, Model, PathObject, ProximitySensor, SceneObject, Shape
from imop.tasks.coppelia.sensors import volume
from imop.types import FloatArray

_PATH = 0.01
"""Metres that a path counts as around its origin, wherever it runs."""

Box = tuple[FloatArray, FloatArray]
"""Lowest and highest corner (3,), in some frame."""


def own_box(o: SceneObject) -> Box | None:
    """The box of an object alone in its own frame; None for kinds that have none."""
    if isinstance(o, Shape | ProximitySensor):
        points = _points(o)
        return (points.min(axis=0), points.max(axis=0)) if len(points) else None
    if isinstance(o, Dummy):
        half = np.full(3, o.size / 2)
    elif isinstance(o, Joint):
        half = np.array([o.size[1], o.size[1], o.size[0]]) / 2
    elif isinstance(o, PathObject):
        half = np.full(3, _PATH / 2)
    else:
        return None
    return -half, half


def _points(o: Shape | ProximitySensor) -> FloatArray:
    if isinstance(o, Shape):
        return o.corners.reshape(-1, 3)
    return volume(o).corners


def model_box(world: World, model: Model, name: str, prefix: str = "") -> Box:
    """The box of an object in its own frame: of all below it if it is a model's base, else of it alone.

    Of what is below, everything counts where it is now, seen or not, but what is flagged to be left out.

    Raises:
        InvalidInput: if there is no such object.
    """
    base = model[name]
    if not base.model_base:
        return own_box(base) or (np.zeros(3), np.zeros(3))
    T_base_world = se3.invert(world.pose(prefix + name))
    found = []
    for i in model.subtree(model.index[name]):
        o = model.objects[i]
        box = None if o.hidden_in_box else own_box(o)
        if box is not None:
            found.append(se3.apply(T_base_world @ world.pose(prefix + o.name), corners(box)))
    points = np.concatenate(found) if found else np.zeros((1, 3))
    return points.min(axis=0), points.max(axis=0)


def corners(box: Box) -> FloatArray:
    """(8, 3)."""
    grid = np.stack(np.meshgrid(*zip(*box, strict=True), indexing="ij"), axis=-1)
    points: FloatArray = grid.reshape(8, 3)
    return points
