"""From an observation to the cloud that everything else works on, with no privileged information."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from imop.errors import InvalidInput
from imop.geometry import cloud as clouds
from imop.geometry import se3
from imop.geometry.cloud import PointCloud
from imop.types import BoolArray, FloatArray, Observation

# The crop that PerAct, RVT and IMOP use on RLBench, metres; what a cell has instead, its set-up says.
WORKSPACE_LOWER = (-0.3, -0.5, 0.6)
WORKSPACE_UPPER = (0.7, 0.5, 1.6)

# The supporting plane has at least so many points, and leans by no more than this (radians).
FEW, LEVEL = 50, 0.2
# Points nearer than this to the supporting plane belong to it, metres.
PLANE_THICKNESS = 0.008

# Edge of the cells (metres) that are open ground if nothing in or beside them leaves the plane by `FLAT`.
OPEN_CELL, FLAT = 0.0125, 0.004

# A point of the plane whose colour differs by more is a mark on it, unless less than this share is plain.
MARKED, PLAIN_SHARE = 0.15, 0.8

# So few points are not thinned by a coarser grid, which has at least eight cells, but one by one.
_CELLS = 2000

# Points of a hand in the gripper's frame, and how near to them something is measured, metres.
_HAND = np.array([(0.0, 0.0, z) for z in (-0.13, -0.11, -0.09, -0.07)])
NEAR_HAND = 0.06
NOTHING_REMOVED = (
    "the self-filter removed nothing, although {} measure something where the hand is; the robot stays in "
    "the cloud. Is the robot's base where the filter has it, and are the joint positions those of its model?"
)

# Which of the points (N, 3) belong to the robot, given its joint positions and gripper opening.
RobotMask = Callable[[FloatArray, FloatArray, float], BoolArray]


class SelfFilterWarning(UserWarning):
    """The self-filter removes nothing although the robot is in view."""


@dataclass(frozen=True)
class Plane:
    """The supporting plane: points p with normal . p = offset; the normal points up."""

    normal: FloatArray
    offset: float

    def height(self, points: FloatArray) -> FloatArray:
        """Signed distance (N,) of points (N, 3) above the plane, metres."""
        return np.asarray(points @ self.normal - self.offset)


@dataclass(frozen=True)
class Perception:
    """Fuse, crop, remove the robot, thin to voxels until they are few enough, estimate normals.

    Attributes:
        robot_mask: the self-filter; None leaves the robot in the cloud.
        voxel: edge of the grid, metres.
        max_points: if there are more, the grid is made coarser, and few are the farthest points.
        lower, upper: (3,) bounds of the workspace, metres.
        align_views: whether a policy corrects the cameras' poses where views disagree, see `view_alignment`;
            the cloud of an observation is made with the poses that the observation says.
    """

    robot_mask: RobotMask | None = None
    voxel: float = 0.005
    max_points: int = 60_000
    lower: tuple[float, float, float] = WORKSPACE_LOWER
    upper: tuple[float, float, float] = WORKSPACE_UPPER
    align_views: bool = True

    def __call__(self, observation: Observation) -> PointCloud:
        """The scene around the robot, with normals; raises as `points` does."""
        return with_normals(self.points(observation), observation)

    def points(self, observation: Observation) -> PointCloud:
        """The scene around the robot, without normals, which take a third of the time.

        Raises:
            InvalidInput: if no depth was measured, if nothing lies in the workspace, or if the self-filter
                is on and the observation has no joint positions.
        """
        everything = clouds.fuse(observation)
        cloud = clouds.crop(everything, self.lower, self.upper)
        if self.robot_mask is not None:
            robot = self._robot(cloud, observation, self.robot_mask)
            if len(robot) and not np.any(robot) and (names := views_of_hand(observation)):
                warnings.warn(NOTHING_REMOVED.format(", ".join(names)), SelfFilterWarning, stacklevel=2)
            cloud = cloud.select(~robot)
        if not len(cloud):
            raise self._nothing(everything)
        voxel, thin = self.voxel, clouds.voxel_downsample(cloud, self.voxel)
        most = max(self.max_points, _CELLS)
        while len(thin) > most:
            # A surface fills as many cells as the square of their edge goes into it.
            voxel *= 1.02 * np.sqrt(len(thin) / most)
            thin = clouds.voxel_downsample(cloud, voxel)
        return thin.select(clouds.farthest_points(thin.points, self.max_points))

    def _nothing(self, everything: PointCloud) -> InvalidInput:
        low, high = np.percentile(everything.points, [5, 95], axis=0).round(2).tolist()
        problem = f"nothing is left in the workspace, most points lie between {low} and {high} m"
        accepted = (
            f"points between lower {self.lower} and upper {self.upper} m, world frame. If the table is "
            "elsewhere, give the workspace of your cell: Perception(lower=..., upper=...), the table "
            "[workspace] of a set-up, or the robot's base with imop predict --base"
        )
        return InvalidInput("views", problem, accepted)

    @staticmethod
    def _robot(cloud: PointCloud, observation: Observation, robot_mask: RobotMask) -> BoolArray:
        if observation.joint_positions is None:
            accepted = "joint angles in radians, or Perception(robot_mask=None)"
            raise InvalidInput("joint_positions", "missing, but the self-filter needs them", accepted)
        return robot_mask(cloud.points, observation.joint_positions, observation.gripper_opening)


def views_of_hand(observation: Observation) -> list[str]:
    """Names of the cameras that measure something where the hand is.

    The hand is taken to be behind the gripper's tip, against the approach direction.
    """
    p_world = se3.apply(observation.T_world_gripper, _HAND)
    names = []
    for name, view in observation.views.items():
        p = se3.apply(se3.invert(view.T_world_camera), p_world)
        p = p[p[:, 2] > NEAR_HAND]
        uv = np.round((p @ view.intrinsics.T)[:, :2] / p[:, 2:]).astype(np.int64)
        height, width = view.depth.shape
        inside = np.all((uv >= 0) & (uv < (width, height)), axis=1)
        u, v = uv[inside].T
        depth = np.where(view.measured[v, u], view.depth[v, u], np.inf)
        if np.sum(np.abs(depth - p[inside, 2]) < NEAR_HAND) >= len(_HAND) / 2:
            names.append(name)
    return names


def with_normals(cloud: PointCloud, observation: Observation, flat: BoolArray | None = None) -> PointCloud:
    """The cloud of an observation with normals; (N,) `flat`: its `open_ground`, if it is known."""
    flat = open_ground(cloud.points) if flat is None else flat
    return clouds.estimate_normals(cloud, viewpoints(observation), flat=flat)


def viewpoints(observation: Observation) -> FloatArray:
    """(C, 3) where the cameras are, world frame."""
    return np.stack([view.T_world_camera[:3, 3] for view in observation.views.values()])


def supporting_plane(cloud: PointCloud, bin_height: float = 0.005) -> Plane | None:
    """The most populated near-horizontal plane of a cloud with normals, or None if there is none.

    Args:
        cloud: needs normals.
        bin_height: height of a slice when counting, metres.

    Raises:
        InvalidInput: if the cloud has no normals.
    """
    if cloud.normals is None:
        raise InvalidInput("cloud.normals", "missing", "a cloud from Perception or estimate_normals")
    level = cloud.points[cloud.normals[:, 2] > np.cos(LEVEL)]
    if len(level) < FEW:
        return None
    height = _most_populated(level[:, 2], bin_height)
    for reach in (2 * bin_height, bin_height):
        near = level[np.abs(level[:, 2] - height) < reach]
        height = float(near[:, 2].mean())
    # Two points, or a thin strip, determine no tilt; a table is level.
    fitted = _level_plane(near) if len(near) > 2 else None
    return fitted or Plane(np.array([0.0, 0.0, 1.0]), float(near[:, 2].mean()))


def _most_populated(z: FloatArray, bin_height: float) -> float:
    """Middle of the slice that most of the heights (N,) are in, metres."""
    # Not a histogram: a single point far away would make it huge.
    slices, counts = np.unique(np.floor(z / bin_height).astype(np.int64), return_counts=True)
    return float((slices[np.argmax(counts)] + 0.5) * bin_height)


def open_plane(points: FloatArray) -> Plane | None:
    """The plane of `open_ground` points (N, 3), if there are enough of them and it is about level."""
    return _level_plane(points) if len(points) >= FEW else None


def _level_plane(points: FloatArray) -> Plane | None:
    """The plane nearest to points (N, 3), N > 2, if it is about level."""
    center, normal = clouds.fit_plane(points)
    normal = normal if normal[2] > 0 else -normal
    return Plane(normal, float(normal @ center)) if normal[2] >= np.cos(LEVEL) else None


def open_ground(points: FloatArray) -> BoolArray:
    """(N,) which points (N, 3) lie in the supporting plane, far from all that is not in it.

    Their normals need no search for neighbours, and most of a scene is bare table.
    """
    if len(points) < FEW:
        return np.zeros(len(points), dtype=bool)
    x, y, z = points.T
    near = points[np.abs(z - _most_populated(z, PLANE_THICKNESS)) < PLANE_THICKNESS]
    center, normal = clouds.fit_plane(near)
    flat = np.abs(points @ normal - center @ normal) < FLAT
    column, row = (((v - v.min()) / OPEN_CELL).astype(np.int64) for v in (x, y))
    taken = np.zeros((column.max() + 1, row.max() + 1), dtype=bool)
    taken[column[~flat], row[~flat]] = True
    beside = ndimage.binary_dilation(taken, np.ones((3, 3), dtype=bool))
    return np.asarray(flat & ~beside[column, row])


@dataclass(frozen=True, eq=False)
class Ground:
    """What of a cloud is bare ground.

    Attributes:
        plane: the supporting plane, or None if there is none.
        bare: (N,) True for points of the plane itself, not of things on it nor of marks in its face. A mark
            has another colour than most of the plane; where much has, the plane is patterned without marks.
        lowest: z of the lowest point, metres.
    """

    plane: Plane | None
    bare: BoolArray
    lowest: float

    def height(self, points: FloatArray) -> FloatArray:
        """(N,) metres of points (N, 3) above the plane, or above the lowest point if there is none."""
        return points[:, 2] - self.lowest if self.plane is None else self.plane.height(points)


def find_ground(cloud: PointCloud, plane: Plane | None = None) -> Ground:
    """The bare ground of a cloud of at least one point.

    Args:
        cloud: with normals, or
        plane: the supporting plane, if it is known.

    Raises:
        InvalidInput: if neither is there.
    """
    plane, lowest = plane or supporting_plane(cloud), float(cloud.points[:, 2].min())
    if plane is None:
        return Ground(None, np.zeros(len(cloud), dtype=bool), lowest)
    bare = np.abs(plane.height(cloud.points)) < PLANE_THICKNESS
    flat = np.flatnonzero(bare)
    if len(flat):
        red, green, blue = np.abs(cloud.colors[flat] - np.median(cloud.colors[flat], axis=0)).T
        plain = np.maximum(np.maximum(red, green), blue) < MARKED
        if np.mean(plain) >= PLAIN_SHARE:
            bare[flat] = plain
    return Ground(plane, bare, lowest)
