"""What counts as one thing in the images, and what motion planning avoids."""

import numpy as np

from imop.sim.world import World
from imop.tasks.coppelia.geoms import SEEN_GROUP
from imop.tasks.coppelia.model import Model, Shape


def separate(world: World, model: Model) -> None:
    """Let every fixed shape that is seen be an instance of its own, as in RLBench's masks.

    To the world all that stands still in a task is one thing, because it hangs on one base.
    """
    base = world.model.body(model.objects[0].name).id
    seen = {int(world.model.geom_bodyid[g]) for g in np.flatnonzero(world.model.geom_group == SEEN_GROUP)}
    for o in model.objects:
        body = world.model.body(o.name).id
        if world.instances[body] != base:
            continue
        parent = int(world.model.body_parentid[body])
        own = isinstance(o, Shape) and body in seen and parent not in seen
        world.instances[body] = body if own else world.instances[parent] if body != base else base
    for body in np.unique(world.instances[world.instances > 0]):
        world.instance_names.setdefault(int(body), world.model.body(int(body)).name)


def unavoided(world: World, model: Model) -> frozenset[int]:
    """Bodies that motion planning ignores: neither they nor what is drawn for them is called collidable."""
    avoided = {i for i, o in enumerate(model.objects) if isinstance(o, Shape) and o.collidable}
    for i in sorted(avoided, reverse=True):
        o = model.objects[i]
        if isinstance(o, Shape) and not o.respondable:
            avoided.add(o.parent)
    shapes = [o.name for i, o in enumerate(model.objects) if isinstance(o, Shape) and i not in avoided]
    return frozenset(int(world.model.body(name).id) for name in shapes)
