"""Calibrations against depth images: view against view, and the robot's shape against what is seen of it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from imop.calibration.problems import Problem
from imop.calibration.refine import moved
from imop.geometry import se3
from imop.geometry.view_alignment import corrected, disagreement, find_errors
from imop.types import CameraView, FloatArray, Observation

RobotDistance = Callable[[FloatArray, FloatArray, float], FloatArray]
"""Points (N, 3), world frame, joint positions, opening -> (N,) metres to the robot, negative inside."""

VIEWS_FAR = 0.6
"""Millimetres by which surfaces of two views may be farther apart than they need to be."""
ROBOT_FAR = 3.5
"""Millimetres by which the robot may seem to be elsewhere; models of arms are not exact."""
REACHES = (0.06, 0.045, 0.03, 0.025, 0.02, 0.015, 0.015, 0.015)
"""Metres around the robot in which points are taken for its own, from the first round to the last."""
POINTS, FEW = 1000, 200
"""Points of a view that are used, and without which nothing is said."""
_LIKELY = np.repeat([np.radians(2.0), 0.01], 3)
_NOISE = 0.005 * np.sqrt(30)
_STEP = 1e-4


@dataclass(frozen=True)
class Off:
    """How far a camera seems to be from where it was said to be.

    Attributes:
        millimetres: between the positions.
        degrees: between the rotations.
        seen: how far what it sees is moved by that, mean, millimetres.
        before: mean distance of points from the surfaces that they should be on, millimetres, as it was said.
        after: the same with the camera where it seems to be.
    """

    millimetres: float
    degrees: float
    seen: float
    before: float
    after: float

    def __str__(self) -> str:
        return (
            f"{self.millimetres:.1f} mm and {self.degrees:.2f} degrees off "
            f"(surfaces {self.before:.1f} mm apart, {self.after:.1f} with that)"
        )


def check_views(observations: Sequence[Observation]) -> tuple[dict[str, Off], list[Problem]]:
    """Whether cameras that see the same surfaces see them in the same place.

    What they cannot tell, such as all being wrong alike, or sliding along a bare table, is not noticed; which
    of two cameras is wrong neither.

    Args:
        observations: of one rig, with the poses that a calibration gave; different things in view tell more.
    """
    names = list(dict.fromkeys(name for o in observations for name in o.views))
    apart = [disagreement(o) for o in observations]
    if len(names) < 2 or not np.any(np.isfinite(apart)):
        return {}, []
    errors = find_errors(observations)
    before = 1000 * float(np.nanmean(apart))
    after = 1000 * float(np.nanmean([disagreement(corrected(o, errors)) for o in observations]))
    found = {}
    for name, T in errors.items():
        view = next(o.views[name] for o in observations if name in o.views)
        found[name] = _off(T, _points(view, POINTS), before, after)
    if before - after < VIEWS_FAR:
        return found, []
    where = "cameras " + " and ".join(names)
    problem = f"they see the same surfaces {before:.1f} mm apart, {after:.1f} if they stood elsewhere"
    remedy = "one of them was knocked, or is calibrated badly: calibrate again"
    return found, [Problem("views_disagree", "error", where, problem, remedy)]


def check_robot(
    observations: Sequence[Observation], distance: RobotDistance
) -> tuple[dict[str, Off], list[Problem]]:
    """Whether each camera sees the robot where its joints say that it is.

    Args:
        observations: with joint positions, with the poses that a calibration gave; different poses of the arm
            tell more.
        distance: to the robot's surface.
    """
    found, problems = {}, []
    for name in dict.fromkeys(name for o in observations for name in o.views):
        seen = [o for o in observations if name in o.views and o.joint_positions is not None]
        off = _robot_off([(o.views[name], o) for o in seen], distance)
        if off is None:
            continue
        found[name] = off
        if off.seen > ROBOT_FAR:
            problem = (
                f"it sees the robot {off.seen:.1f} mm beside where its joints say; the camera may be {off}"
            )
            remedy = (
                "look whether the camera was knocked, whether joint positions are of this moment, and "
                "whether the robot's model is right"
            )
            problems.append(Problem("robot_elsewhere", "error", f"camera {name}", problem, remedy))
    return found, problems


def _off(T: FloatArray, points: FloatArray, before: float, after: float) -> Off:
    angle = float(np.degrees(se3.rotation_distance(T, np.eye(4))))
    seen = float(np.linalg.norm(se3.apply(T, points) - points, axis=1).mean())
    return Off(1000 * float(np.linalg.norm(T[:3, 3])), angle, 1000 * seen, before, after)


def _robot_off(seen: Sequence[tuple[CameraView, Observation]], distance: RobotDistance) -> Off | None:
    """The motion of a camera that puts what it sees of the robot onto its surface."""
    clouds = [_near(view, o, distance) for view, o in seen]
    if sum(len(cloud) for cloud in clouds) < FEW:
        return None
    T, before, after = np.eye(4), 0.0, 0.0
    for i, reach in enumerate(REACHES):
        H, g, off = np.diag(_LIKELY**-2), _LIKELY**-2 * _twist(T), []
        for (view, o), cloud in zip(seen, clouds, strict=True):
            J, d = _rows(view.T_world_camera @ T, cloud, o, distance, reach)
            weight = (1 + (d / (reach / 2)) ** 2) ** -2 / _NOISE**2
            H, g = H + (J * weight[:, None]).T @ J, g + (J * weight[:, None]).T @ d
            off.append(np.abs(d[np.abs(d) < REACHES[-1]]))
        after = 1000 * float(np.concatenate(off).mean())
        before = after if i == 0 else before
        step = -np.linalg.solve(H, g)
        T = T @ moved(np.asarray(step))
    return _off(T, np.concatenate(clouds), before, after)


def _twist(T: FloatArray) -> FloatArray:
    return np.concatenate([Rotation.from_matrix(T[:3, :3]).as_rotvec(), T[:3, 3]])


def _near(view: CameraView, observation: Observation, distance: RobotDistance) -> FloatArray:
    """(N, 3) points in the camera's frame that may be on the robot."""
    p = _points(view, 15 * POINTS)
    q = observation.joint_positions
    assert q is not None
    near = distance(se3.apply(view.T_world_camera, p), q, observation.gripper_opening) < REACHES[0]
    p = p[near]
    return p[:: max(1, len(p) // POINTS)]


def _points(view: CameraView, most: int) -> FloatArray:
    """(N, 3) some of the points that a view measured, in the camera's frame."""
    row, column = np.nonzero(view.measured)
    some = slice(None, None, max(1, len(row) // most))
    row, column = row[some], column[some]
    z, K = view.depth[row, column].astype(np.float64), view.intrinsics
    return np.stack([(column - K[0, 2]) / K[0, 0] * z, (row - K[1, 2]) / K[1, 1] * z, z], axis=1)


def _rows(
    T_world_camera: FloatArray,
    cloud: FloatArray,
    observation: Observation,
    distance: RobotDistance,
    reach: float,
) -> tuple[FloatArray, FloatArray]:
    """(N, 6) derivatives by turn and shift of the camera, and (N,) distances, of points within reach."""
    q, opening = observation.joint_positions, observation.gripper_opening
    assert q is not None
    p = se3.apply(T_world_camera, cloud)
    d = distance(p, q, opening)
    near = np.abs(d) < reach
    p, d, cloud = p[near], d[near], cloud[near]
    slope = np.stack([distance(p + step, q, opening) - d for step in _STEP * np.eye(3)], axis=1) / _STEP
    by_shift = slope @ T_world_camera[:3, :3]
    return np.concatenate([np.cross(cloud, by_shift), by_shift], axis=1), d
