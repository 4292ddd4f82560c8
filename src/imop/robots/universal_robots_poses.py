"""Poses as controllers of Universal Robots have them."""

from collections.abc import Sequence

from scipy.spatial.transform import Rotation

from imop.geometry import se3
from imop.types import FloatArray


def to_vector(T: FloatArray) -> list[float]:
    """A pose (4, 4) as the controller has it: x y z, metres, and the rotation vector, radians."""
    return [*T[:3, 3].tolist(), *Rotation.from_matrix(T[:3, :3]).as_rotvec().tolist()]


def from_vector(vector: Sequence[float]) -> FloatArray:
    """The pose (4, 4) of `to_vector`."""
    return se3.make(Rotation.from_rotvec(vector[3:]).as_matrix(), tuple(vector[:3]))
