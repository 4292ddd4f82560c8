"""Numbers of a set-up, with their units checked as far as their size tells."""

from typing import Any

import numpy as np

from imop.errors import InvalidInput
from imop.types import FloatArray, as_finite, as_pose, as_positive

FARTHEST = 10.0
"""A cell is a few metres; a coordinate beyond this is in millimetres."""
LARGEST_ANGLE = 4 * np.pi
"""A joint position beyond this is in degrees."""


def as_place(name: str, value: Any) -> FloatArray:
    """As `as_pose`; refuses positions that are not in metres."""
    T = as_pose(name, value)
    as_box(name, T[:3, 3])
    return T


def as_box(name: str, value: Any) -> FloatArray:
    """(3,) coordinates or lengths, metres."""
    p = as_finite(name, value, (3,))
    if np.abs(p).max() > FARTHEST:
        raise InvalidInput(
            name, f"{np.round(p, 3).tolist()}", f"metres, at most {FARTHEST:g}; not millimetres"
        )
    return p


def as_length(name: str, value: Any, longest: float) -> float:
    """A length above 0, metres."""
    return as_positive(name, value, longest, "metres, not millimetres")


def as_angles(name: str, value: Any) -> FloatArray:
    """(J,) joint positions, radians; J is at least 1."""
    q = as_finite(name, value, (None,))
    if not len(q):
        raise InvalidInput(name, "empty", "a position for each joint of the arm, radians")
    if np.abs(q).max() > LARGEST_ANGLE:
        raise InvalidInput(name, f"{np.round(q, 3).tolist()}", "radians, not degrees")
    return q


def as_direction(name: str, value: Any) -> FloatArray:
    """(3,) of length 1; what is given may be of any other but 0."""
    v = as_finite(name, value, (3,))
    length = float(np.linalg.norm(v))
    if length < 1e-6:
        raise InvalidInput(name, f"{v.tolist()}", "a direction, such as [0, 0, 1]")
    return as_finite(name, v / length, (3,))
