"""Needles that a joint drags along and that stay where they were last: what happened, kept in the physics.

They are saved, restored and simulated with everything else, whoever steps the world.
"""

from typing import Any

import mujoco

_TIME = 0.003
"""Seconds in which a needle that nothing pushes comes to rest, friction aside."""


def add_needle(parent: Any, name: str, range_: float, friction: float, inertia: float) -> None:
    """Add an invisible body on a slide `name`, from 0 to `range_`, that nothing but friction holds.

    Args:
        parent: body that gets the needle.
        name: of the needle's body and of its slide.
        range_: metres.
        friction: newtons.
        inertia: kilograms. Of two needles in one `drag`, the one that shall move has far less of both.
    """
    body = parent.add_body(name=name, gravcomp=1)
    body.mass, body.inertia, body.explicitinertial = 0.001, (1e-6, 1e-6, 1e-6), True
    body.add_joint(
        name=name,
        type=mujoco.mjtJoint.mjJNT_SLIDE,
        axis=[1, 0, 0],
        range=[0, range_],
        limited=mujoco.mjtLimited.mjLIMITED_TRUE,
        frictionloss=friction,
        damping=inertia / _TIME,
        armature=inertia,
    )


def drag(spec: Any, needle: str, ahead: str, behind: str | None = None) -> None:
    """Keep `needle` at least at the position of `ahead`, or of `ahead` minus `behind`.

    The needle so shows the largest value there ever was.
    """
    link = spec.add_tendon(name=needle, limited=mujoco.mjtLimited.mjLIMITED_TRUE, range=[0, 10])
    link.solref_limit = (0.004, 1)
    link.wrap_joint(needle, 1)
    link.wrap_joint(ahead, -1)
    if behind is not None:
        link.wrap_joint(behind, 1)
