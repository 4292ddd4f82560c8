"""What imop asks of an RGB-D camera, simulated or real. Where it stands, the set-up says."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from imop.types import (
    ByteArray,
    CameraView,
    Float32Array,
    FloatArray,
    as_array,
    as_finite,
    as_image,
    as_intrinsics,
    freeze,
)


@dataclass(frozen=True, eq=False)
class Frame:
    """One registered RGB-D image; colour and depth have the same pixels.

    Attributes:
        rgb: (H, W, 3) uint8.
        depth: (H, W) float32, metres along the optical axis; 0, NaN and inf mean no measurement.
        intrinsics: (3, 3) pixels, of rgb and depth; lens distortion is removed already.
        stamp: seconds of the clock that the arm's states have too.

    Raises:
        InvalidInput: for a value that is none of these.
    """

    rgb: ByteArray
    depth: Float32Array
    intrinsics: FloatArray
    stamp: float = 0.0

    def __post_init__(self) -> None:
        rgb = as_image("rgb", self.rgb)
        freeze(
            self,
            rgb=rgb,
            depth=as_array("depth", self.depth, rgb.shape[:2], np.float32),
            intrinsics=as_intrinsics("intrinsics", self.intrinsics),
            stamp=float(as_finite("stamp", self.stamp, ())),
        )

    def seen_from(self, T_world_camera: FloatArray) -> CameraView:
        """The same image, of a camera at a pose (4, 4).

        Raises:
            InvalidInput: if the pose is no rigid transformation.
        """
        return CameraView(self.rgb, self.depth, self.intrinsics, T_world_camera)


class Camera(Protocol):
    """One camera that is running."""

    def capture(self) -> Frame:
        """A frame that was taken after this call.

        Raises:
            ConnectionError: if the camera does not deliver one.
        """
        ...
