"""What a cheap depth camera does to a clean image: a model of a stereo camera such as RealSense's D415."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from imop.geometry import se3
from imop.types import BoolArray, CameraView, Float32Array, Observation

_FOCAL_TIMES_BASELINE = 0.055 * 450
"""Metres times pixels; turns disparity (pixels) into depth."""
_ROWS = 128
"""Of an image for which lengths in pixels are meant; they are multiples of that in an image of more rows."""


@dataclass(frozen=True)
class DepthNoise:
    """How bad the images are; all zeros leave them alone.

    Attributes:
        disparity: steps in which disparity is measured, pixels.
        wave: standard deviation of smooth disparity error, pixels.
        bleed: share of the pixels at depth edges that take their neighbour's depth.
        holes: share of the pixels lost in patches, and twice that at edges.
        calibration: standard deviation of the camera's supposed position, metres; in turn, radians, the same.
        lose_view: probability that one view is missing.
    """

    disparity: float = 0.0
    wave: float = 0.0
    bleed: float = 0.0
    holes: float = 0.0
    calibration: float = 0.0
    lose_view: float = 0.0

    @classmethod
    def of_d415(cls) -> "DepthNoise":
        """As bad as a D415 at two metres in a plain room: the worst that training sees, with no view lost."""
        return cls(0.06, 0.05, 0.5, 0.05)

    @classmethod
    def sample(cls, rng: np.random.Generator) -> "DepthNoise":
        """Clean half of the time, else anything up to a real camera's."""
        lose = 0.1
        if rng.random() < 0.5:
            return cls(lose_view=lose)
        s = rng.uniform(0.1, 1.0)
        return cls(0.06 * s, 0.05 * s, 0.5 * s, 0.05 * s, 0.0015 * s, lose)

    def __call__(self, observation: Observation, rng: np.random.Generator) -> Observation:
        """The observation as such cameras would have given it."""
        views = dict(observation.views)
        if len(views) > 2 and rng.random() < self.lose_view:
            del views[str(rng.choice(sorted(views)))]
        return replace(observation, views={name: self.view(v, rng) for name, v in views.items()})

    def view(self, view: CameraView, rng: np.random.Generator) -> CameraView:
        """One view as such a camera would have given it."""
        if not (self.disparity or self.wave or self.bleed or self.holes or self.calibration):
            return view
        depth = view.depth.copy()
        height, width = depth.shape
        grain = max(1, round(height / _ROWS))
        edge = _edges(depth, grain)
        moved = edge & (rng.random(depth.shape) < self.bleed)
        row, column = np.nonzero(moved)
        shift = rng.integers(-grain, grain + 1, (2, len(row)))
        depth[row, column] = view.depth[
            np.clip(row + shift[0], 0, height - 1), np.clip(column + shift[1], 0, width - 1)
        ]
        depth = self._measured(depth, rng, 2.0 * grain)
        lost = ndimage.gaussian_filter(rng.normal(size=depth.shape), 1.5 * grain)
        lost = lost / max(float(lost.std()), 1e-9)
        threshold = np.quantile(lost, 1 - self.holes) if self.holes else np.inf
        depth[(lost > threshold) | (edge & (rng.random(depth.shape) < 2 * self.holes))] = 0.0
        error = rng.normal(0, self.calibration, 6) if self.calibration else np.zeros(6)
        T = view.T_world_camera @ se3.make(se3.euler(*error[3:]), error[:3])
        return replace(view, depth=depth, T_world_camera=T)

    def _measured(self, depth: Float32Array, rng: np.random.Generator, sigma: float) -> Float32Array:
        """Depth after its disparity was disturbed, alike within `sigma` pixels, and rounded."""
        seen = depth > 0
        disparity = _FOCAL_TIMES_BASELINE / np.where(seen, depth, 1.0)
        smooth = ndimage.gaussian_filter(rng.normal(size=depth.shape), sigma)
        disparity = disparity + self.wave * smooth / max(float(smooth.std()), 1e-9)
        if self.disparity:
            disparity = np.round(disparity / self.disparity) * self.disparity
        worse = _FOCAL_TIMES_BASELINE / np.maximum(disparity, 1e-3)
        return np.where(seen, worse, 0.0).astype(np.float32)


def _edges(depth: Float32Array, grain: int, gap: float = 0.02) -> BoolArray:
    """(H, W) True within `grain` pixels of where the depth jumps by more than `gap` metres."""
    far, near = ndimage.maximum_filter(depth, 3), ndimage.minimum_filter(depth, 3)
    return np.asarray(ndimage.maximum_filter(far - near > gap, 2 * grain - 1))
