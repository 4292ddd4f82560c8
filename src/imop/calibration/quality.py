"""How well a calibration is known, and which pictures do not fit it."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from imop.calibration.diagnose import wrong_square
from imop.calibration.problems import Problem
from imop.calibration.refine import Poses, Refined, refine
from imop.calibration.result import Quality
from imop.calibration.series import Corners, Series
from imop.geometry import se3
from imop.types import FloatArray

Pictures = Mapping[str, Mapping[int, Corners]]

SQUARE_OFF, SURE = 0.007, 5.0
"""Share by which squares may differ from what was said, and standard deviations from which that is sure."""
OUTLIER, OUTLIER_TIMES = 2.0, 4.0
"""Pixels, and times the median of all shots, from which a shot does not fit."""
SUSPICIOUS = 1.0
"""Median error in pixels from which it is asked whether something was moved between two shots."""
KNOCKED_GAIN = 0.6
"""Share of the error that has to go if a camera was moved meanwhile."""
PRECISE = 2.0, 0.3
"""Millimetres and degrees, standard error, beyond which a calibration is called imprecise."""


def size_problem(series: Series, pictures: Pictures, refined: Refined) -> list[Problem]:
    """Whether squares of another size fit clearly better."""
    free = refine(series, pictures, refined.poses, free_scale=True)
    off = np.log(free.scale)
    deviation = np.sqrt(free.covariance[-1, -1])
    if abs(off) < max(SQUARE_OFF, SURE * deviation):
        return []
    return [wrong_square(series, "board", free.scale)]


def shot_problems(
    series: Series, pictures: Pictures, refined: Refined
) -> tuple[list[Problem], dict[str, dict[int, Corners]]]:
    """Shots that do not fit, and cameras that were moved between two shots; and the pictures that fit."""
    problems: list[Problem] = []
    good: dict[str, dict[int, Corners]] = {}
    for name in series.cameras:
        if refined.median(name) > SUSPICIOUS:
            knocked = _knocked_between(series, pictures, refined, name)
            if knocked is not None:
                return [*problems, knocked], good
        errors = shot_errors(refined, name)
        limit = max(OUTLIER, OUTLIER_TIMES * float(np.median(list(errors.values()))))
        for i, pixels in errors.items():
            if pixels > limit:
                usual = refined.median(name)
                problem = f"its corners lie {pixels:.1f} px from where they should, usual are {usual:.1f}"
                where = f"camera {name}, {series.shots[i].name or f'shot {i}'}"
                remedy = "it is left out; take pictures when the arm stands still"
                problems.append(Problem("outlier", "warning", where, problem, remedy))
        good[name] = {i: corners for i, corners in pictures[name].items() if errors[i] <= limit}
    return problems, good


def shot_errors(refined: Refined, name: str) -> dict[int, float]:
    """Number of the shot -> median distance in pixels of its corners from where they should be."""
    distances, shot = np.linalg.norm(refined.errors[name], axis=1), refined.shot[name]
    return {int(i): float(np.median(distances[shot == i])) for i in np.unique(shot)}


def _knocked_between(series: Series, pictures: Pictures, refined: Refined, name: str) -> Problem | None:
    """One camera as two, one until a shot and one after it: whether that explains the errors."""
    numbers = sorted(pictures[name])
    best: tuple[float, int, float, float] | None = None
    for k in range(3, len(numbers) - 2):
        before, after = f"{name} before", f"{name} after"
        cameras = {n: c for n, c in series.cameras.items() if n != name}
        cameras |= {before: series.cameras[name], after: series.cameras[name]}
        split = {n: p for n, p in pictures.items() if n != name}
        split |= {
            before: {i: pictures[name][i] for i in numbers[:k]},
            after: {i: pictures[name][i] for i in numbers[k:]},
        }
        poses = {n: T for n, T in refined.poses.cameras.items() if n != name}
        poses |= {before: refined.poses.cameras[name], after: refined.poses.cameras[name]}
        bare = replace(series, cameras=cameras, shots=[replace(shot, corners={}) for shot in series.shots])
        apart = refine(bare, split, Poses(poses, refined.poses.board))
        errors = np.concatenate([apart.errors[before], apart.errors[after]])
        off = float(np.median(np.linalg.norm(errors, axis=1)))
        if best is None or off < best[0]:
            T = se3.invert(apart.poses.cameras[before]) @ apart.poses.cameras[after]
            best = off, k, float(np.linalg.norm(T[:3, 3])), float(se3.rotation_distance(T, np.eye(4)))
    if best is None or best[0] > KNOCKED_GAIN * refined.median(name):
        return None
    off, k, distance, angle = best
    names = [series.shots[i].name or f"shot {i}" for i in (numbers[k - 1], numbers[k])]
    problem = (
        f"between {names[0]} and {names[1]} it was moved by {1000 * distance:.1f} mm and "
        f"{np.degrees(angle):.2f} degrees (errors {refined.median(name):.1f} px, {off:.1f} with that)"
    )
    remedy = "fix the camera (and the board) so that nothing can move, and take the series again"
    return Problem("knocked", "error", f"camera {name}", problem, remedy)


def find_quality(
    series: Series,
    pictures: Pictures,
    T_camera_board: Mapping[str, Mapping[int, FloatArray]],
    refined: Refined,
) -> tuple[dict[str, Quality], list[Problem]]:
    """Of each camera, and warnings for those that are known badly.

    Args:
        series: what was seen.
        pictures: camera -> number of the shot -> corners without distortion.
        T_camera_board: camera -> number of the shot -> (4, 4) from this picture alone.
        refined: poses that fit all pictures.
    """
    numbers = sorted({i for shots in pictures.values() for i in shots})
    without = [refine(series, pictures, refined.poses, [j for j in numbers if j != i]).poses for i in numbers]
    found, problems = {}, []
    for name in series.cameras:
        T = np.stack([poses.cameras[name] for poses in without])
        shifts = 1000 * se3.translation_distance(T, refined.poses.cameras[name])
        turns = np.degrees(se3.rotation_distance(T, refined.poses.cameras[name]))
        # The jackknife: leaving out one of n changes a mean by 1 / (n - 1) of that one's error.
        n = max(len(pictures[name]), 2)
        errors = shot_errors(refined, name)
        worst = max(errors, key=lambda i: errors[i])
        found[name] = quality = Quality(
            len(pictures[name]),
            refined.rms(name),
            series.shots[worst].name or f"shot {worst}",
            errors[worst],
            _millimetres(series, T_camera_board[name], refined.poses, name),
            float(np.sqrt((n - 1) / n * np.sum(shifts**2))),
            float(np.sqrt((n - 1) / n * np.sum(turns**2))),
            float(shifts.max()),
            float(turns.max()),
            refined.deviation,
            _common(refined, name),
        )
        if quality.millimetres_off > PRECISE[0] or quality.degrees_off > PRECISE[1]:
            known = f"{quality.millimetres_off:.1f} mm and {quality.degrees_off:.2f} degrees"
            problem = f"its pose is known to {known} only"
            remedy = "take more pictures, nearer to the board, with the hand turned about two axes"
            problems.append(Problem("imprecise", "warning", f"camera {name}", problem, remedy))
    return found, problems


def _common(refined: Refined, name: str) -> float:
    at = 6 * list(refined.poses.cameras).index(name)
    block = np.s_[at : at + 6, at : at + 6]
    independent = refined.deviation**2 * refined.independent[block]
    # Both in the units of the one, so that turns and shifts count alike.
    return max(1.0, float(np.trace(np.linalg.solve(independent, refined.covariance[block]))) / 6)


def _millimetres(series: Series, seen: Mapping[int, FloatArray], poses: Poses, name: str) -> float:
    distances = []
    for i, T_camera_board in seen.items():
        M = series.motion(name, series.shots[i].T_base_gripper)
        T = se3.invert(poses.cameras[name]) @ M @ poses.board
        off = se3.apply(T, series.board.corners) - se3.apply(T_camera_board, series.board.corners)
        distances.append(1000 * float(np.linalg.norm(off, axis=1).mean()))
    return float(np.median(distances))
