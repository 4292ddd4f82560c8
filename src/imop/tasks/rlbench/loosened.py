"""Parts that a task takes off: in the file they hang rigidly on others, in MuJoCo they must be free."""

from dataclasses import replace

from imop.geometry import se3
from imop.tasks.coppelia.model import Model


def loosened(model: Model, name: str) -> Model:
    """The model with an object hung under its root, where it is; a dynamic shape is free then.

    Raises:
        InvalidInput: if there is no such object.
    """
    part = model[name]
    T_root_part = se3.invert(model.T_world_moved[0]) @ model.T_world(name)
    moved = replace(part, parent=0, T_parent_object=T_root_part)
    return Model(tuple(moved if o is part else o for o in model.objects), model.textures)
