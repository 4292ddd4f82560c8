"""Things of another size: bodies of a scene that is not compiled yet, enlarged or made smaller as a whole."""

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np

from imop.types import FloatArray


def resize(
    spec: Any, bodies: Sequence[Any], scale: float, centre: Sequence[float] | FloatArray = (0.0, 0.0, 0.0)
) -> None:
    """Scale bodies with all that hangs on them about a point; what is as dense as before weighs scale^3.

    Args:
        spec: `mujoco.MjSpec` of the scene. Meshes of the bodies must not be used by others.
        bodies: of the uppermost level.
        scale: 1 leaves them as they are.
        centre: point of the world, metres, that stays.
    """
    fixed = np.asarray(centre, dtype=np.float64)
    meshes = set()
    for body in bodies:
        body.pos = fixed + scale * (body.pos - fixed)
        for part in _subtree(body):
            if part is not body:
                part.pos = scale * part.pos
            _resize_inertia(part, scale)
            for joint in part.joints:
                _resize_joint(joint, scale)
            for geom in (*part.geoms, *part.sites):
                geom.pos, geom.size, geom.fromto = scale * geom.pos, scale * geom.size, scale * geom.fromto
            for geom in part.geoms:
                geom.mass = scale**3 * geom.mass
                meshes |= {geom.meshname} - {""}
    for name in meshes:
        mesh = spec.mesh(name)
        mesh.scale = scale * mesh.scale


def _subtree(body: Any) -> Iterator[Any]:
    yield body
    for child in body.bodies:
        yield from _subtree(child)


def _resize_inertia(body: Any, scale: float) -> None:
    if body.explicitinertial:
        body.ipos = scale * body.ipos
        body.mass, body.inertia = scale**3 * body.mass, scale**5 * body.inertia


def _resize_joint(joint: Any, scale: float) -> None:
    joint.pos = scale * joint.pos
    if joint.type == mujoco.mjtJoint.mjJNT_SLIDE:
        joint.range = scale * joint.range
        joint.ref, joint.springref = scale * joint.ref, scale * joint.springref
