"""Cameras that hang a little elsewhere in every scene."""

from dataclasses import replace

import numpy as np

from imop.geometry import se3
from imop.sim.cameras import CAMERAS, Camera

USUAL = 0.4
"""Share of the scenes with the cameras in their usual places."""
SHIFT, TURN = 0.06, np.radians(4.0)
"""Standard deviations along and about each axis, metres and radians; a fifth for the camera on the hand."""
_LIMIT = 2.0


def placed_cameras(rng: np.random.Generator) -> dict[str, Camera]:
    """The robot's cameras, moved at random; what they report of their places is true."""
    if rng.random() < USUAL:
        return dict(CAMERAS)
    return {name: _moved(camera, rng) for name, camera in CAMERAS.items()}


def _moved(camera: Camera, rng: np.random.Generator) -> Camera:
    share = 0.2 if camera.on_gripper else 1.0
    shift, turn = (share * scale * rng.normal(size=3).clip(-_LIMIT, _LIMIT) for scale in (SHIFT, TURN))
    return replace(camera, T_mount_camera=camera.T_mount_camera @ se3.make(se3.euler(*turn), shift))
