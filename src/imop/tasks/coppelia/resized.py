"""What a file would say if everything in it were larger or smaller by one factor."""

from dataclasses import replace

import numpy as np

from imop.geometry import se3
from imop.tasks.coppelia.model import (
    Dummy,
    Joint,
    Model,
    PathObject,
    Piece,
    ProximitySensor,
    SceneObject,
    Shape,
)
from imop.types import FloatArray


def resized(model: Model, scale: float, centre: FloatArray) -> Model:
    """The model at `scale` times its size, about a point of the world (3,) that stays."""

    def moved(T: FloatArray) -> FloatArray:
        return se3.make(T[:3, :3], centre + scale * (T[:3, 3] - centre))

    objects = []
    for o in model.objects:
        T = moved(o.T_parent_object) if o.parent < 0 else _scaled(o.T_parent_object, scale)
        objects.append(replace(_larger(o, scale), T_parent_object=T))
    return Model(tuple(objects), model.textures)


def _scaled(T: FloatArray, scale: float) -> FloatArray:
    return se3.make(T[:3, :3], scale * T[:3, 3])


def _larger(o: SceneObject, s: float) -> SceneObject:
    """The object itself, wherever it is."""
    if isinstance(o, Shape):
        return replace(
            o,
            pieces=tuple(_piece(piece, s) for piece in o.pieces),
            T_shape_inertia=_scaled(o.T_shape_inertia, s),
            mass=s**3 * o.mass,
            moments=s**5 * o.moments,
        )
    if isinstance(o, Joint):
        low, high = o.limits or (0.0, 0.0)
        slides, size = o.kind == "prismatic", (s * o.size[0], s * o.size[1])
        if not slides:
            return replace(o, size=size, lead=s * o.lead)
        limits = None if o.limits is None else (s * low, s * high)
        target = s * o.target_position
        return replace(o, size=size, position=s * o.position, limits=limits, target_position=target)
    if isinstance(o, ProximitySensor):
        near, far = (tuple((s * np.array(end)).tolist()) for end in (o.near, o.far))
        return replace(o, offset=s * o.offset, range=s * o.range, near=near, far=far)
    if isinstance(o, PathObject):
        return replace(o, T_path_points=np.stack([_scaled(T, s) for T in o.T_path_points]))
    return replace(o, size=s * o.size) if isinstance(o, Dummy) else o


def _piece(piece: Piece, s: float) -> Piece:
    return replace(
        piece,
        size=tuple((s * np.array(piece.size)).tolist()),
        T_shape_mesh=_scaled(piece.T_shape_mesh, s),
        vertices=(s * piece.vertices).astype(np.float32),
    )
