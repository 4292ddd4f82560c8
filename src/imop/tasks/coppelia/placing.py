"""Moving and colouring what a model brought, after the scene was compiled.

Nested bodies are moved by rewriting where they hang (`body_pos`, `body_quat` of the model), which `World`
saves and restores with its state; free bodies by their joint. Nothing has to be compiled again.
"""

from collections.abc import Sequence

import numpy as np

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.sim.world import World
from imop.tasks.coppelia import dynamics
from imop.tasks.coppelia.geoms import SEEN_GROUP, own_color
from imop.tasks.coppelia.model import Joint, Model
from imop.types import FloatArray, as_pose


def place(world: World, model: Model, name: str, T_world_object: FloatArray, prefix: str = "") -> None:
    """Put an object at a pose, and with it all below it in the model's tree, free bodies included, at rest.

    Raises:
        InvalidInput: if there is no such object, or it is a joint.
    """
    T = as_pose("T_world_object", T_world_object)
    i = model.index[model[name].name]
    o = model.objects[i]
    if isinstance(o, Joint):
        raise InvalidInput("object", f"{name} is a joint", "a joint's parent, or World.set_joint")
    T_new_old = T @ se3.invert(world.pose(prefix + name))
    free = [model.objects[k].name for k in model.subtree(i) if dynamics.is_free(model, k)]
    poses = {n: T_new_old @ world.pose(prefix + n) for n in free}
    if name not in poses:
        body = world.model.body(prefix + name)
        parent = world.model.body(int(body.parentid[0])).name
        T_parent_object = se3.invert(world.pose(parent)) @ T
        body.pos, body.quat = T_parent_object[:3, 3], se3.to_wxyz(T_parent_object)
        world.forward()
    for n, pose in poses.items():
        world.set_free_pose(prefix + n, pose)


def place_position(world: World, model: Model, name: str, p_world: Sequence[float] | FloatArray) -> None:
    """As `place`, keeping the orientation.

    Raises:
        InvalidInput: if there is no such object, or it is a joint.
    """
    T = world.pose(model[name].name)
    place(world, model, name, se3.make(T[:3, :3], np.asarray(p_world, dtype=np.float64)))


def recolor(world: World, name: str, rgb: Sequence[float], prefix: str = "") -> None:
    """Give everything that is seen of one shape a colour (0 .. 1), but not what hangs on it.

    Pictures are tinted by it. A world's saved state holds no colours.
    """
    m = world.model
    own = (m.geom_bodyid == m.body(prefix + name).id) & (m.geom_group == SEEN_GROUP)
    m.geom_rgba[own, :3] = own_color(rgb)
