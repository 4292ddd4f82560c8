"""A joint that turns."""

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np


def hinge(
    body: Any,
    name: str,
    axis: Sequence[float],
    limits: tuple[float, float],
    pos: Sequence[float] = (0.0, 0.0, 0.0),
    friction: float = 0.0,
    damping: float = 0.05,
) -> None:
    """Let `body` turn about `axis` through `pos` (its own frame, metres).

    Args:
        body: hangs on its parent by this joint.
        name: of the joint.
        axis: in the body's frame.
        limits: of the angle, radians.
        pos: a point of the axis.
        friction: torque that holds the body where it is, N m.
        damping: N m s.
    """
    body.add_joint(
        name=name,
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=list(axis),
        pos=list(pos),
        range=list(np.degrees(limits)),  # a spec is written in degrees
        limited=mujoco.mjtLimited.mjLIMITED_TRUE,
        frictionloss=friction,
        # Friction of MuJoCo's default softness lets a heavy lid creep.
        solimp_friction=[0.995, 0.999, 0.001, 0.5, 2],
        damping=damping,
        armature=0.002,
    )
