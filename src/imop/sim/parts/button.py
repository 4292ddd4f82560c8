"""A spring button that remembers whether it was pressed, and watches over the order of several."""

from typing import Any

import mujoco

from imop.sim.parts.memory import add_needle, drag
from imop.sim.parts.shapes import PLASTIC, Color, cylinder, part

STROKE = 0.010
"""How deep the cap goes, metres."""
PRESSED, OUT_OF_ORDER = 0.6 * STROKE, 0.4 * STROKE
HOUSING = 0.022
CAP = 0.022
"""Of the cap's top above the housing, when it is up."""
_STRENGTH, _PRELOAD = 250.0, 0.005
_PRESS_NEEDLE = (0.2, 0.1)
_ORDER_NEEDLE = (0.01, 0.0003)
"""Friction in newtons and inertia in kilograms."""


def spring_button(radius: float, color: Color, housing_color: Color) -> Any:
    """A round button fixed on the table; frame: centre of its base.

    Body "cap" (frame: centre of its top) is on the slide "cap", 0 up and `STROKE` down. Joint "pressed" shows
    how deep it ever was.
    """
    spec, body = part(fixed=True)
    cylinder(body, radius + 0.012, 0, 0.6 * HOUSING, housing_color, PLASTIC)
    cylinder(body, radius + 0.005, 0.6 * HOUSING, HOUSING, housing_color, PLASTIC)
    cap = body.add_body(name="cap", pos=[0, 0, HOUSING + CAP])
    cylinder(cap, radius, -CAP, -0.003, color, PLASTIC)
    cylinder(cap, 0.9 * radius, -0.003, 0.0, color, PLASTIC)
    cap.add_joint(
        name="cap",
        type=mujoco.mjtJoint.mjJNT_SLIDE,
        axis=[0, 0, -1],
        range=[0, STROKE],
        limited=mujoco.mjtLimited.mjLIMITED_TRUE,
        stiffness=_STRENGTH,
        springref=-_PRELOAD,
        solref_limit=[0.004, 1],
        damping=6.0,
        armature=0.05,
    )
    spec.add_exclude(bodyname1="body", bodyname2="cap")
    add_needle(body, "pressed", STROKE, *_PRESS_NEEDLE)
    drag(spec, "pressed", "cap")
    return spec


def watch_order(spec: Any, name: str, first: str, second: str) -> None:
    """Add a joint `name` to the scene: past `OUT_OF_ORDER`, button `second` was pressed before `first`.

    Args:
        spec: the scene, with both buttons attached.
        name: of the joint.
        first: prefix of a button ("button0").
        second: prefix of another.
    """
    add_needle(spec.worldbody, name, STROKE, *_ORDER_NEEDLE)
    drag(spec, name, f"{second}/pressed", f"{first}/pressed")
