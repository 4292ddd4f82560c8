"""Which points of a scene are meant, when a person, a detector or a click says so."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from imop.errors import InvalidInput
from imop.geometry.cloud import PointCloud, project
from imop.geometry.neighbours import within
from imop.types import BoolArray, FloatArray, Observation, as_array

# A point is meant if one that was named is this near to it, metres.
AROUND = 0.015
# A point is seen by a pixel whose depth differs no more than this from its own, metres.
SEEN = 0.015


@dataclass(frozen=True, eq=False)
class Focus:
    """A thing, said in one of three ways; what any of them names is meant.

    Attributes:
        masks: name of a view -> (H, W) True where the thing is in its image.
        points: (N, 3) points on the thing, world frame, metres.
        box: (2, 3) lower and upper corner of a box around it, world frame, metres.
    """

    masks: Mapping[str, BoolArray] | None = None
    points: FloatArray | None = None
    box: FloatArray | None = None

    def __post_init__(self) -> None:
        if self.masks is None and self.points is None and self.box is None:
            raise InvalidInput("focus", "says nothing", "masks, points or a box")
        if self.points is not None:
            object.__setattr__(self, "points", as_array("points", self.points, (None, 3)))
        if self.box is not None:
            box = as_array("box", self.box, (2, 3))
            if (box[0] > box[1]).any():
                raise InvalidInput("box", "the lower corner is above the upper one", "lower, then upper")
            object.__setattr__(self, "box", box)


def in_focus(focus: Focus, observation: Observation, cloud: PointCloud) -> BoolArray:
    """(N,) which points of a cloud are meant.

    Args:
        focus: what was said.
        observation: that the cloud was made of.
        cloud: N points, world frame.

    Raises:
        InvalidInput: if a mask is of a view that is not there, or not of its size.
    """
    meant = np.zeros(len(cloud), dtype=bool)
    for name, mask in (focus.masks or {}).items():
        view = observation.views.get(name)
        if view is None or np.shape(mask) != view.depth.shape:
            problem = f"view {name} is missing" if view is None else f"{name} has shape {np.shape(mask)}"
            accepted = ", ".join(f"{k} {v.depth.shape}" for k, v in observation.views.items())
            raise InvalidInput("focus.masks", problem, accepted)
        (column, row), z, inside = (part.T for part in project(view, cloud.points))
        seen = np.zeros(len(cloud), dtype=bool)
        seen[inside] = np.abs(view.depth[row, column] - z)[inside] < SEEN
        meant |= seen & np.asarray(mask, dtype=bool)[row, column]
    if focus.points is not None and len(focus.points):
        meant |= within(cloud.points, focus.points, AROUND)
    if focus.box is not None:
        meant |= ((cloud.points >= focus.box[0]) & (cloud.points <= focus.box[1])).all(axis=1)
    return meant
