"""Changes of a model before it is converted, where our physics needs another tree, solids or words."""

from dataclasses import replace

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.tasks.coppelia.model import Model, SceneObject, Shape


def loosened(model: Model, name: str) -> Model:
    """The model with an object hung under its root, where it is; a dynamic shape is a free body then.

    Raises:
        InvalidInput: if there is no such object.
    """
    part = model[name]
    T_root_part = se3.invert(model.T_world_moved[0]) @ model.T_world(name)
    return _with(model, part, replace(part, parent=0, T_parent_object=T_root_part))


def fixed(model: Model, name: str) -> Model:
    """The model with a shape that does not move against what it hangs on.

    Raises:
        InvalidInput: if there is no such shape.
    """
    part = _shape(model, name)
    return _with(model, part, replace(part, dynamic=False))


def hollow(model: Model, name: str) -> Model:
    """The model without contacts of a shape, such as a mesh whose holes MuJoCo would fill.

    Raises:
        InvalidInput: if there is no such shape.
    """
    part = _shape(model, name)
    return _with(model, part, replace(part, respondable=False))


def reworded(model: Model, waypoint: str, words: str) -> Model:
    """The model with other words on a waypoint.

    Raises:
        InvalidInput: if there is no such object.
    """
    part = model[waypoint]
    return _with(model, part, replace(part, extension=words))


def _shape(model: Model, name: str) -> Shape:
    part = model[name]
    if not isinstance(part, Shape):
        raise InvalidInput("shape", name, "the name of a shape")
    return part


def _with(model: Model, old: SceneObject, new: SceneObject) -> Model:
    return Model(tuple(new if o is old else o for o in model.objects), model.textures)
