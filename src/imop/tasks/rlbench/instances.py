"""What counts as one thing in the images, and what motion planning avoids."""

import numpy as np

from imop.sim.world import World
from imop.tasks.coppelia.geoms import SEEN_GROUP
from imop.tasks.coppelia.model import Model, Shape


def separate(world: World, model: Model) -> None:
    """Let every fixed thing that is seen be an instance of its own, named after its uppermost part.

    To the world all that stands still in a task is one thing, because it hangs on one base. What is only
    felt (a bin) is one thing with what is drawn for it.
    """
    numbers = [int(world.model.body(o.name).id) for o in model.objects]
    base = numbers[0]
    seen = {int(world.model.geom_bodyid[g]) for g in np.flatnonzero(world.model.geom_group == SEEN_GROUP)}
    fixed = [int(world.model.body_weldid[n]) == 0 for n in numbers]
    for i, o in enumerate(model.objects):
        body, parent = numbers[i], int(world.model.body_parentid[numbers[i]])
        if body == base or world.instances[body] != base:
            continue
        plane = isinstance(o, Shape) and not o.respondable and body not in seen
        shows = any(fixed[j] and numbers[j] in seen for j in model.subtree(i))
        own = world.instances[parent] == base and shows and not plane
        world.instances[body] = body if own else world.instances[parent]
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
