"""Rotations as RVT predicts them: a class of 5 degrees for each Euler angle."""

import numpy as np
import torch
from scipy.spatial.transform import Rotation
from torch import Tensor

BINS = 72
_WIDTH = 2 * np.pi / BINS
_STRAIGHT = np.radians(5)
"""Nearer than this to the pole, where two of the angles are not determined, one of them is set to 0."""


def angles_of(R: Tensor) -> Tensor:
    """(B, 3) angles about the fixed x, y and z axes, radians, of rotations (B, 3, 3)."""
    angles = []
    for rotation in R.double().numpy():
        if np.hypot(rotation[0, 0], rotation[1, 0]) < np.sin(_STRAIGHT):
            pole = -np.sign(rotation[2, 0]) * np.pi / 2
            # What is left is a turn about the vertical: that of the y axis, which stays level.
            angles.append((0.0, pole, np.arctan2(-rotation[0, 1], rotation[1, 1])))
        else:
            angles.append(tuple(Rotation.from_matrix(rotation).as_euler("xyz")))
    return torch.tensor(angles, dtype=torch.float32)


def rotations_of(angles: Tensor) -> Tensor:
    """(B, 3, 3) rotations of angles (B, 3), as `angles_of`."""
    return torch.from_numpy(Rotation.from_euler("xyz", angles.double().numpy()).as_matrix()).float()


def shares_of(angles: Tensor) -> Tensor:
    """(B, 3, BINS) what the two nearest classes have of each angle (B, 3), by how near they are."""
    place = (angles / _WIDTH) % BINS
    below = place.floor().long() % BINS
    part = (place - place.floor()).clamp(0, 1)
    shares = torch.zeros(*angles.shape, BINS)
    shares.scatter_(-1, below[..., None], 1 - part[..., None])
    return shares.scatter_add_(-1, ((below + 1) % BINS)[..., None], part[..., None])


def likeliest(scores: Tensor) -> Tensor:
    """(B, 3) angles by scores (B, 3, BINS): the best class, moved towards its better neighbours."""
    best = scores.argmax(-1, keepdim=True)
    near = (best + torch.tensor([-1, 0, 1])) % BINS
    weights = scores.gather(-1, near).softmax(-1)
    return (best[..., 0] + weights[..., 2] - weights[..., 0]) * _WIDTH
