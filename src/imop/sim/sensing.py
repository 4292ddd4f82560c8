"""How a scene is looked at: with which cameras, and what is wrong with what they say."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial.transform import Rotation

from imop.geometry import se3
from imop.sim.cameras import CAMERAS, Camera, observe
from imop.sim.depth_noise import DepthNoise
from imop.sim.world import World
from imop.types import FloatArray, Observation


def calibration_error(rng: np.random.Generator, distance: float, angle: float) -> FloatArray:
    """T_camera_told (4, 4): `distance` metres and `angle` radians off in random directions."""
    shift, axis = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
    return se3.make(Rotation.from_rotvec(angle * axis).as_matrix(), distance * shift)


@dataclass(frozen=True, eq=False)
class Sensing:
    """Cameras with their errors; by default the robot's own, without any.

    Attributes:
        cameras: what there is.
        T_camera_told: camera -> (4, 4) where it is said to be, in the camera's true frame; others are where
            they are said to be.
        noise: of depth.
        seed: of the noise, which is another one at each time step.
    """

    cameras: Mapping[str, Camera] = field(default_factory=lambda: CAMERAS)
    T_camera_told: Mapping[str, FloatArray] = field(default_factory=dict)
    noise: DepthNoise | None = None
    seed: tuple[int, ...] = ()

    def __call__(self, world: World, time_step: int) -> Observation:
        """What is seen of a scene now."""
        return self.worsened(observe(world, time_step, cameras=self.cameras))

    def worsened(self, observation: Observation) -> Observation:
        """What would have been seen by these cameras instead of perfect ones in the same places.

        Raises:
            InvalidInput: if none of the cameras is left.
        """
        views = {name: view for name, view in observation.views.items() if name in self.cameras}
        for name, T_camera_told in self.T_camera_told.items():
            if name in views:
                T_world_told = views[name].T_world_camera @ T_camera_told
                views[name] = replace(views[name], T_world_camera=T_world_told)
        seen = replace(observation, views=views)
        if self.noise is None:
            return seen
        return self.noise(seen, np.random.default_rng((*self.seed, observation.time_step)))
