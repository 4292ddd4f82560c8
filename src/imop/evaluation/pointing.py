"""What somebody who stands by would point at: the thing that a demonstration acts on first."""

from collections.abc import Callable

import numpy as np

from imop.geometry.focus import Focus
from imop.types import Demonstration, Observation

Pointing = Callable[[int, Observation], Focus | None]
"""Number of the action and what is seen, with segmentation -> what is pointed at before it."""


def pointing(demonstration: Demonstration) -> Pointing:
    """Points at the object of the first step until the gripper has closed; reads what only people see.

    Args:
        demonstration: with names of the objects that the steps are fixed to.
    """
    name, closing = demonstration.keyframes[0].object_name, demonstration.closing

    def point(number: int, seen: Observation) -> Focus | None:
        return None if number > closing else focus_on(name, seen)

    return point


def focus_on(name: str | None, seen: Observation) -> Focus | None:
    """The masks of an object in an observation with segmentation; None if it is not in sight."""
    numbers = [i for i, other in (seen.instance_names or {}).items() if other == name]
    masks = {
        view_name: np.isin(view.instance_ids, numbers)
        for view_name, view in seen.views.items()
        if view.instance_ids is not None
    }
    return Focus(masks=masks) if any(mask.any() for mask in masks.values()) else None
