"""Point-to-plane iterative closest point (small_gicp), from coarse to fine."""

import numpy as np
import small_gicp

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.types import FloatArray

STAGES = (0.04, 0.02, 0.01)
NEARBY, CLOSE, FINEST = STAGES[1:], STAGES[2:], (0.005,)
# small_gicp takes fewer points for a mistake.
SMALLEST = 10


class Refiner:
    """Aligns regions to one observed cloud.

    Args:
        points: (N, 3) observed points, world frame, metres; at least 5.

    Raises:
        InvalidInput: if there are fewer points.
    """

    def __init__(self, points: FloatArray):
        if len(points) < 5:
            raise InvalidInput("points", f"{len(points)} points", "at least 5 to estimate tangent planes")
        self._target = small_gicp.PointCloud(points)
        self._tree = small_gicp.KdTree(self._target)
        small_gicp.estimate_normals(self._target, self._tree, num_neighbors=12)

    @property
    def normals(self) -> FloatArray:
        """(N, 3) of the observed points, either way round; of no length where there is no tangent plane."""
        return np.asarray(self._target.normals())[:, :3]

    def __call__(
        self, region: FloatArray, T: FloatArray, stages: tuple[float, ...] = STAGES, iterations: int = 20
    ) -> FloatArray:
        """The motion (4, 4) near `T` that lays the region (M, 3) onto the observed surface.

        Args:
            region: points of the demonstrated scene, metres.
            T: (4, 4) first guess.
            stages: largest distance of a pair in each stage, metres.
            iterations: at most, per stage.

        Returns:
            `T` itself if the region has fewer points than `SMALLEST`.
        """
        if len(region) < SMALLEST:
            return T
        source = small_gicp.PointCloud(region)
        for reach in stages:
            result = small_gicp.align(
                self._target,
                source,
                self._tree,
                init_T_target_source=T,
                registration_type="PLANE_ICP",
                max_correspondence_distance=reach,
                max_iterations=iterations,
                rotation_epsilon=1e-3,
                translation_epsilon=1e-4,
            )
            moved = np.asarray(result.T_target_source)
            # Too few pairs leave the linear system singular.
            if not np.all(np.isfinite(moved)) or result.num_inliers < 6:
                break
            T = moved
        return T


def upright(T: FloatArray, center: FloatArray) -> FloatArray:
    """The motion (4, 4) with its tilt removed: the nearest turn about the vertical, same place for `center`.

    Things that stand on a table in both scenes have not been tilted, however few points say so.
    """
    R = se3.euler(z=se3.yaw(T))
    return se3.make(R, T[:3, :3] @ center + T[:3, 3] - R @ center)
