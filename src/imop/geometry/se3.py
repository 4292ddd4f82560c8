"""Rigid motions as (..., 4, 4) matrices, any batch dimensions; quaternions xyzw but for MuJoCo's."""

import numpy as np
from scipy.spatial.transform import Rotation

from imop.errors import InvalidInput
from imop.types import BoolArray, FloatArray


def make(R: FloatArray | None = None, p: FloatArray | tuple[float, ...] | None = None) -> FloatArray:
    """The transformation with rotation `R` (..., 3, 3) and translation `p` (..., 3); identity where None."""
    R = np.eye(3) if R is None else np.asarray(R, dtype=np.float64)
    p = np.zeros(3) if p is None else np.asarray(p, dtype=np.float64)
    batch = np.broadcast_shapes(R.shape[:-2], p.shape[:-1])
    T = np.broadcast_to(np.eye(4), (*batch, 4, 4)).copy()
    T[..., :3, :3] = R
    T[..., :3, 3] = p
    return T


def invert(T: FloatArray) -> FloatArray:
    """T_b_a of T_a_b, (..., 4, 4)."""
    R_inverse = np.swapaxes(T[..., :3, :3], -1, -2)
    p_inverse = -(R_inverse @ T[..., :3, 3:])[..., 0]
    return make(R_inverse, p_inverse)


def lengths(vectors: FloatArray) -> FloatArray:
    """(N,) Euclidean norms of vectors (N, 3); on many short rows several times as fast as numpy's norm."""
    return np.asarray(np.sqrt(np.einsum("nk,nk->n", vectors, vectors)))


def apply(T_a_b: FloatArray, p_b: FloatArray) -> FloatArray:
    """Points `p_b` (..., N, 3) of frame b in frame a, for `T_a_b` (..., 4, 4)."""
    moved: FloatArray = p_b @ np.swapaxes(T_a_b[..., :3, :3], -1, -2) + T_a_b[..., None, :3, 3]
    return moved


def rotate(T_a_b: FloatArray, v_b: FloatArray) -> FloatArray:
    """Directions `v_b` (..., N, 3) of frame b in frame a."""
    turned: FloatArray = v_b @ np.swapaxes(T_a_b[..., :3, :3], -1, -2)
    return turned


def from_pose7(pose: FloatArray) -> FloatArray:
    """(..., 7) position and quaternion xyzw -> (..., 4, 4).

    Raises:
        InvalidInput: if the last dimension is not 7 or a quaternion is far from unit length.
    """
    pose = np.asarray(pose, dtype=np.float64)
    accepted = "(..., 7): x y z in metres and a unit quaternion x y z w"
    if pose.ndim == 0 or pose.shape[-1] != 7:
        raise InvalidInput("pose", f"shape {pose.shape}", accepted)
    if not np.all(np.abs(np.linalg.norm(pose[..., 3:], axis=-1) - 1.0) < 1e-2):
        raise InvalidInput("pose", "quaternion is not of unit length", accepted)
    R = Rotation.from_quat(pose[..., 3:].reshape(-1, 4)).as_matrix().reshape(*pose.shape[:-1], 3, 3)
    return make(R, pose[..., :3])


def to_pose7(T: FloatArray) -> FloatArray:
    """(..., 4, 4) -> (..., 7) position and quaternion xyzw with w >= 0."""
    quaternions = Rotation.from_matrix(T[..., :3, :3].reshape(-1, 3, 3)).as_quat(canonical=True)
    return np.concatenate([T[..., :3, 3], quaternions.reshape(*T.shape[:-2], 4)], axis=-1)


def to_wxyz(T: FloatArray) -> FloatArray:
    """Rotations (..., 3, 3), or those of poses (..., 4, 4) -> (..., 4) in MuJoCo's order, with w >= 0."""
    R = T[..., :3, :3]
    quaternions = Rotation.from_matrix(R.reshape(-1, 3, 3)).as_quat(canonical=True, scalar_first=True)
    return np.asarray(quaternions.reshape(*T.shape[:-2], 4))


def from_wxyz(quaternion: FloatArray) -> FloatArray:
    """(..., 4) quaternions of any length in MuJoCo's order -> (..., 3, 3)."""
    quaternion = np.asarray(quaternion, dtype=np.float64)
    R = Rotation.from_quat(quaternion.reshape(-1, 4), scalar_first=True).as_matrix()
    return np.asarray(R.reshape(*quaternion.shape[:-1], 3, 3))


def rotation_distance(T_a: FloatArray, T_b: FloatArray) -> FloatArray:
    """Angle between the rotations, (...,) radians in [0, pi]."""
    relative = np.swapaxes(T_a[..., :3, :3], -1, -2) @ T_b[..., :3, :3]
    batch = relative.shape[:-2]
    return np.asarray(Rotation.from_matrix(relative.reshape(-1, 3, 3)).magnitude().reshape(batch))


def translation_distance(T_a: FloatArray, T_b: FloatArray) -> FloatArray:
    """Distance between the origins, (...,) metres."""
    return np.asarray(np.linalg.norm(T_a[..., :3, 3] - T_b[..., :3, 3], axis=-1))


def near(T_a: FloatArray, T_b: FloatArray, distance: float, angle: float) -> BoolArray:
    """(...,) whether poses are less than `distance` metres and `angle` radians apart."""
    return (translation_distance(T_a, T_b) < distance) & (rotation_distance(T_a, T_b) < angle)


def euler(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> FloatArray:
    """Rotation (3, 3) about the fixed x, then y, then z axis."""
    return np.asarray(Rotation.from_euler("xyz", (x, y, z)).as_matrix())


def yaw(T: FloatArray) -> float:
    """The turn about the vertical, radians, that is nearest to the rotation of a motion (4, 4)."""
    return float(np.arctan2(T[1, 0] - T[0, 1], T[0, 0] + T[1, 1]))


def orthonormal(T: FloatArray) -> FloatArray:
    """The pose (4, 4) with rounding errors of its rotation removed."""
    U, _, Vh = np.linalg.svd(T[:3, :3])
    clean = T.copy()
    clean[:3, :3] = U @ Vh
    return clean
