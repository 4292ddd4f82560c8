"""From what was seen of a board to where the cameras are."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from imop.calibration.detect import board_pose, project, undistorted
from imop.calibration.diagnose import ENOUGH, diagnose
from imop.calibration.intrinsics import FOCAL_OFF, INTRINSICS_REMEDY, found_intrinsics, intrinsics_problem
from imop.calibration.problems import NotCalibrated, Problem
from imop.calibration.quality import find_quality, shot_problems, size_problem
from imop.calibration.refine import Poses, refine
from imop.calibration.result import CalibratedCamera, Calibration
from imop.calibration.series import Corners, Series
from imop.calibration.solvers import mean_pose, starts
from imop.geometry import se3
from imop.types import FloatArray


@dataclass(frozen=True, eq=False)
class Prepared:
    """A series whose cameras have intrinsics, without distortion.

    Attributes:
        series: it.
        pictures: camera -> number of the shot -> corners as a pinhole camera would see them.
        T_camera_board: camera -> number of the shot -> (4, 4) from this picture alone.
    """

    series: Series
    pictures: Mapping[str, Mapping[int, Corners]]
    T_camera_board: Mapping[str, Mapping[int, FloatArray]]


def calibrate(series: Series, T_world_base: FloatArray | None = None) -> Calibration:
    """Where the cameras of a series are, and how well that is known.

    Args:
        series: what was seen.
        T_world_base: (4, 4) of the arm's base in the world; the base is the world if not given.

    Raises:
        NotCalibrated: if something is wrong with the series; its `problems` name what, and what to do.
        MissingExtra: without OpenCV.
    """
    prepared = prepare(series)
    found_out = [problem for name in series.cameras for problem in _problems(prepared, name)]
    _raise_errors(found_out)
    refined = refine(prepared.series, prepared.pictures, start_poses(prepared))
    found_out += size_problem(prepared.series, prepared.pictures, refined)
    problems, pictures = shot_problems(prepared.series, prepared.pictures, refined)
    found_out += problems
    _raise_errors(found_out)
    if problems:
        refined = refine(prepared.series, pictures, refined.poses)
    quality, imprecise = find_quality(prepared.series, pictures, prepared.T_camera_board, refined)
    cameras = {
        name: CalibratedCamera(prepared.series.cameras[name], refined.poses.cameras[name], quality[name])
        for name in series.cameras
    }
    T_base = np.eye(4) if T_world_base is None else T_world_base
    board = refined.poses.board
    return Calibration(cameras, series.board, series.board_on, board, T_base, [*found_out, *imprecise])


def prepare(series: Series) -> Prepared:
    """Find intrinsics that are not given, remove distortion, place the board in each picture.

    Raises:
        NotCalibrated: if intrinsics are missing and there are too few pictures.
    """
    cameras, pictures, poses = {}, {}, {}
    for name, camera in series.cameras.items():
        corners = {i: series.shots[i].corners[name] for i in series.shots_of(name)}
        if camera.intrinsics is None:
            camera = found_intrinsics(name, camera, series.board, corners)
        K = camera.intrinsics
        assert K is not None
        cameras[name] = camera
        pictures[name] = {i: undistorted(c, K, camera.distortion) for i, c in corners.items()}
        poses[name] = {i: board_pose(series.board, c, K) for i, c in pictures[name].items()}
    return Prepared(replace(series, cameras=cameras), pictures, poses)


def start_poses(prepared: Prepared) -> Poses:
    """The solution of OpenCV's solvers that puts the corners nearest to where they were seen."""
    series = prepared.series
    best: tuple[float, FloatArray] | None = None
    for name in moving_cameras(series):
        A, M = _equation(prepared, name)
        for X, Y in starts(A, M):
            off = _error(prepared, name, X, Y)
            if best is None or off < best[0]:
                best = off, Y
    if best is None:
        raise NotCalibrated([_no_moving_camera()])
    board = best[1]
    cameras = {}
    for name in series.cameras:
        A, M = _equation(prepared, name)
        cameras[name] = mean_pose(M @ board @ se3.invert(A))
    return Poses(cameras, board)


def moving_cameras(series: Series) -> list[str]:
    """Cameras before which the board moves with the arm."""
    return [name for name, c in series.cameras.items() if c.mount == "hand" or series.board_on == "hand"]


def _no_moving_camera() -> Problem:
    problem = "the board lies on the table, and no camera on the hand sees it"
    remedy = "let the hand hold the board, or add a camera on the hand"
    return Problem("alike", "error", "board", problem, remedy)


def _equation(prepared: Prepared, name: str) -> tuple[FloatArray, FloatArray]:
    poses = prepared.T_camera_board[name]
    T = np.stack([prepared.series.shots[i].T_base_gripper for i in poses])
    return np.stack(list(poses.values())), prepared.series.motion(name, T)


def _error(prepared: Prepared, name: str, X: FloatArray, Y: FloatArray) -> float:
    """Median distance of corners from where they should be, pixels."""
    series, K = prepared.series, prepared.series.cameras[name].intrinsics
    assert K is not None
    off = []
    for i, corners in prepared.pictures[name].items():
        T = se3.invert(X) @ series.motion(name, series.shots[i].T_base_gripper) @ Y
        off.append(np.linalg.norm(project(T, series.board.corners[corners.ids], K) - corners.pixels, axis=1))
    return float(np.median(np.concatenate(off)))


def _problems(prepared: Prepared, name: str) -> list[Problem]:
    series, camera = prepared.series, prepared.series.cameras[name]
    numbers = list(prepared.pictures[name])
    off = _single_picture_error(prepared, name)
    problems = intrinsics_problem(
        name, camera, series.board, {i: series.shots[i].corners[name] for i in numbers}, off
    )
    if problems:
        return problems
    if name not in moving_cameras(series):
        if not moving_cameras(series):
            return [_no_moving_camera()]
        few = Problem(
            "few", "error", f"camera {name}", "the board was not seen", "put it where all cameras see it"
        )
        return [] if numbers else [few]
    problems = diagnose(series, name, numbers, _stack(prepared.T_camera_board[name]))
    return _wrong_intrinsics(prepared, name) or problems if _misfit(problems) else problems


def _misfit(problems: Sequence[Problem]) -> bool:
    return any(problem.kind in ("unexplained", "square_size") for problem in problems)


def _wrong_intrinsics(prepared: Prepared, name: str) -> list[Problem]:
    """Whether all fits with intrinsics that are found from the pictures instead of those given."""
    series, camera = prepared.series, prepared.series.cameras[name]
    numbers = list(prepared.pictures[name])
    if len(numbers) < ENOUGH or camera.intrinsics is None:
        return []
    corners = {i: series.shots[i].corners[name] for i in numbers}
    found = found_intrinsics(name, camera, series.board, corners).intrinsics
    assert found is not None
    given = camera.intrinsics[0, 0]
    A = np.stack([board_pose(series.board, c, found) for c in prepared.pictures[name].values()])
    if abs(found[0, 0] / given - 1) < FOCAL_OFF or _misfit(diagnose(series, name, numbers, A)):
        return []
    problem = f"all fits with a focal length of {found[0, 0]:.0f} px, not with {given:.0f} px as given"
    return [Problem("intrinsics", "error", f"camera {name}", problem, INTRINSICS_REMEDY)]


def _stack(poses: Mapping[int, FloatArray]) -> FloatArray:
    return np.stack(list(poses.values())) if poses else np.empty((0, 4, 4))


def _single_picture_error(prepared: Prepared, name: str) -> float:
    K = prepared.series.cameras[name].intrinsics
    assert K is not None
    points = prepared.series.board.corners
    squares = [
        np.square(project(T, points[prepared.pictures[name][i].ids], K) - prepared.pictures[name][i].pixels)
        for i, T in prepared.T_camera_board[name].items()
    ]
    return float(np.sqrt(np.concatenate(squares).sum(axis=1).mean())) if squares else 0.0


def _raise_errors(problems: Sequence[Problem]) -> None:
    errors = [problem for problem in problems if problem.severity == "error"]
    if errors:
        raise NotCalibrated(errors)
