"""From the tree of a model file to a MuJoCo scene.

Every object becomes a body of its own name, so that poses are asked for and waypoints hang as in the file:
shapes with their geometry, joints as bodies whose frame is the joint's moved frame, dummies, sensors and
paths as bodies with a site of the same name and no geometry. Static objects and what rides on others are
nested as in the file; a dynamic shape that no joint holds is free and stands at the top.
"""

from typing import Any

import mujoco
import numpy as np

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.tasks.coppelia import dynamics
from imop.tasks.coppelia.geoms import Assets, add_geoms
from imop.tasks.coppelia.masses import mass_and_moments
from imop.tasks.coppelia.model import Joint, Model, ProximitySensor, Shape
from imop.types import FloatArray

SETTLING = 0.1
"""Seconds in which a joint without motor loses most of its speed; CoppeliaSim's solvers damp as well."""
LEAST_TURNED, LEAST_PUSHED = 1e-4, 0.01
"""kg m2 and kg that every hinge and slide feels: caps and cranks of some grams would whirl."""
_STIFF_FRICTION = (0.995, 0.999, 0.001, 0.5, 2)
"""Friction of MuJoCo's default softness lets heavy things creep."""
_SITE_GROUP = 4


def add_model(spec: Any, model: Model, prefix: str = "") -> None:
    """Add everything in `model` to a scene, where it stands in the file.

    Args:
        spec: `mujoco.MjSpec` to change.
        model: what to add.
        prefix: of all names.

    Raises:
        InvalidInput: if the scene already has a body of one of the names.
    """
    for o in model.objects:
        if spec.body(prefix + o.name) is not None:
            raise InvalidInput("model", f"a body {prefix + o.name!r} in the scene", "names of their own")
    masses = {
        i: mass_and_moments(o) for i, o in enumerate(model.objects) if isinstance(o, Shape) and o.dynamic
    }
    assets = Assets(spec, model, prefix)
    bodies: list[Any] = []
    for i, o in enumerate(model.objects):
        free = dynamics.is_free(model, i)
        top = free or o.parent < 0
        T = model.T_world_moved[i] if top else o.T_parent_object
        if not top and isinstance(o, Joint):
            T = T @ o.T_motion
        body = _body(spec.worldbody if top else bodies[o.parent], prefix + o.name, T)
        bodies.append(body)
        if free:
            body.add_freejoint(name=prefix + o.name)
        if isinstance(o, Shape):
            add_geoms(assets, body, o)
            if i in masses:
                _set_mass(body, o, *masses[i])
        elif isinstance(o, Joint):
            if dynamics.is_moving_joint(model, i):
                _add_joint(body, o, prefix, dynamics.joint_inertia(model, i, masses))
        else:
            _add_site(body, prefix + o.name, o)
    for i, o in enumerate(model.objects):
        if isinstance(o, Joint) and o.motor == "spring" and dynamics.is_moving_joint(model, i):
            for k in dynamics.carried(model, i):
                bodies[k].gravcomp = 1
    for a, b in dynamics.passing_pairs(model):
        spec.add_exclude(bodyname1=prefix + a, bodyname2=prefix + b)


def _body(parent: Any, name: str, T: FloatArray) -> Any:
    return parent.add_body(name=name, pos=T[:3, 3], quat=se3.to_wxyz(T))


def _set_mass(body: Any, shape: Shape, mass: float, moments: FloatArray) -> None:
    T = shape.T_shape_inertia
    body.mass, body.inertia, body.explicitinertial = mass, moments, True
    body.ipos, body.iquat = T[:3, 3], se3.to_wxyz(T)


def _add_joint(body: Any, joint: Joint, prefix: str, inertia: float) -> None:
    """Let `body`, which stands where the joint's position puts it, move.

    A motor that is told to stand still is friction of its greatest force.
    """
    spring, turns = joint.motor == "spring", joint.kind == "revolute"
    least = LEAST_TURNED if turns else LEAST_PUSHED if joint.kind == "prismatic" else 0.0
    # A spec is written in degrees.
    scale = np.degrees(1.0) if turns else 1.0
    options: dict[str, Any] = {
        "name": prefix + joint.name,
        "axis": [0, 0, 1],
        "armature": max(0.05 * inertia, least),
        "damping": max(joint.damping if spring else 0.0, inertia / SETTLING, least / SETTLING),
        "solimp_friction": _STIFF_FRICTION,
    }
    if joint.kind == "spherical":
        body.add_joint(type=mujoco.mjtJoint.mjJNT_BALL, **options)
        return
    if joint.limits is not None:
        low, high = min(joint.limits[0], joint.position), max(joint.limits[1], joint.position)
        options |= {"limited": mujoco.mjtLimited.mjLIMITED_TRUE, "range": [scale * low, scale * high]}
    if spring:
        options |= {"stiffness": joint.stiffness, "springref": scale * joint.target_position}
    elif joint.motor != "off":
        options["frictionloss"] = joint.max_force
    kind = mujoco.mjtJoint.mjJNT_HINGE if turns else mujoco.mjtJoint.mjJNT_SLIDE
    body.add_joint(type=kind, ref=scale * joint.position, **options)


def _add_site(body: Any, name: str, o: Any) -> None:
    """A mark at the object's frame, or the box around a sensor's volume; nothing but viewers read it."""
    if not isinstance(o, ProximitySensor):
        body.add_site(name=name, size=[0.003] * 3, group=_SITE_GROUP)
        return
    half = np.maximum([*np.maximum(o.near, o.far), o.range / 2], 1e-4)
    T = se3.make(p=(0.0, 0.0, o.offset + o.range / 2))
    body.add_site(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=T[:3, 3],
        size=half,
        rgba=[0.2, 0.8, 0.2, 0.3],
        group=_SITE_GROUP,
    )
