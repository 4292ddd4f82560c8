"""Series of known rigs, for tests."""

from dataclasses import replace

import numpy as np

from imop.calibration.series import Series
from imop.calibration.synthetic import Noise, Truth, random_poses, random_truth

QUIET = Noise(0.3)
MOUNTS = ("world", "hand")


def rig(seed: int, mount: str, shots: int = 15, noise: Noise = QUIET) -> tuple[Truth, Series]:
    """A random rig, and what it sees of the board."""
    rng = np.random.default_rng(seed)
    truth = random_truth(rng, mount)
    return truth, truth.series(random_poses(rng, truth, shots), rng, noise)


def gripper_poses(series: Series) -> np.ndarray:
    return np.stack([shot.T_base_gripper for shot in series.shots])


def with_poses(series: Series, T: np.ndarray) -> Series:
    """The same pictures with other poses of the robot."""
    shots = [replace(shot, T_base_gripper=pose) for shot, pose in zip(series.shots, T, strict=True)]
    return replace(series, shots=shots)
