"""Why pictures and robot poses do not fit: known mistakes are tried, and the right one is named."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from imop.calibration.angles import as_if_degrees, as_if_radians
from imop.calibration.problems import Kind, Problem
from imop.calibration.series import Series
from imop.calibration.solvers import Fit, fit_scaled
from imop.geometry import se3
from imop.types import FloatArray

LEAST, ENOUGH = 3, 8
"""Pictures without which there is no solution, and with which there is a good one."""
TURNED = np.radians(5.0)
"""The camera has to see the board turned by at least this much about a second axis, standard deviation."""
FITS = np.radians(1.5), 0.012
"""Radians and metres up to which pictures agree with the robot's poses, in the median."""
BETTER = 3.0
"""Another reading of the poses is right if it fits so many times better."""
LITTLE, STILL = 0.3, 0.003
"""The robot's poses turn little, or not at all, beside what is seen (share)."""
SCALE_OFF = 0.1
"""Share from which the closed form notices another scale; the refinement notices smaller ones."""
_UNITS = {0.001: "millimetres", 0.01: "centimetres", 0.0254: "inches"}
_MOST_METRES = 10.0


@dataclass(frozen=True, eq=False)
class _Reading:
    """One way in which poses may have been meant.

    Attributes:
        kind: the mistake.
        meant: (N, 4, 4) T_base_gripper as meant.
        problem: what was done.
        remedy: how to mend it.
    """

    kind: Kind
    meant: FloatArray
    problem: str
    remedy: str


def diagnose(series: Series, camera: str, numbers: Sequence[int], A: FloatArray) -> list[Problem]:
    """What is wrong with the poses of a series, as one camera sees it; empty if they fit.

    Args:
        series: what was seen.
        camera: its name; one that moves relative to the board.
        numbers: of the shots in which it sees the board.
        A: (N, 4, 4) T_camera_board in these shots.
    """
    where = f"camera {camera}"
    if len(numbers) < LEAST:
        problem = f"the board was seen in {len(numbers)} of {len(series.shots)} pictures"
        return [
            Problem(
                "few", "error", where, problem, f"take at least {ENOUGH}, better 15, with the whole board"
            )
        ]
    T = np.stack([series.shots[i].T_base_gripper for i in numbers])
    far = float(np.median(np.linalg.norm(T[:, :3, 3], axis=1)))
    if far > _MOST_METRES:
        problem = f"the gripper is said to be {far:.0f} m from the arm's base"
        return [
            Problem("robot_units", "error", where, problem, "give positions in metres, not in millimetres")
        ]
    return (
        _alike(where, A)
        or _turning(series, camera, A, T)
        or _reading(series, camera, A, T)
        or _scale(series, where, fit_scaled(A, series.motion(camera, T)))
        or _few(where, len(numbers))
    )


def _few(where: str, n: int) -> list[Problem]:
    if n >= ENOUGH:
        return []
    problem, remedy = f"the board was seen in {n} pictures only", f"take at least {ENOUGH}, better 15"
    return [Problem("few", "warning", where, problem, remedy)]


def spread_of_turns(T: FloatArray) -> FloatArray:
    """(3,) standard deviations of turns (N, 4, 4) along their principal axes, radians, largest first."""
    i, j = np.triu_indices(len(T), 1)
    turns = Rotation.from_matrix(T[i, :3, :3] @ np.swapaxes(T[j, :3, :3], -1, -2)).as_rotvec()
    # Pairs differ by twice the variance of single poses.
    variances = np.linalg.eigvalsh(turns.T @ turns / len(turns) / 2)
    return np.asarray(np.sqrt(np.maximum(variances, 0.0))[::-1], dtype=np.float64)


def _alike(where: str, A: FloatArray) -> list[Problem]:
    first, second = np.degrees(spread_of_turns(A)[:2])
    if second >= np.degrees(TURNED):
        return []
    limit = f"{np.degrees(TURNED):.0f} degrees"
    if first < np.degrees(TURNED):
        problem = f"the board hardly turns ({first:.1f} degrees, standard deviation; {limit} are needed)"
    else:
        problem = (
            f"the board turns about one axis only ({first:.1f} degrees, {second:.1f} about the others, "
            f"standard deviation; {limit} are needed about two)"
        )
    remedy = "turn the hand by 20 to 40 degrees about two different axes between the pictures"
    return [Problem("alike", "error", where, problem, remedy)]


def _turning(series: Series, camera: str, A: FloatArray, T: FloatArray) -> list[Problem]:
    """The robot must turn as much as the board does before the camera."""
    seen, said = (float(np.linalg.norm(spread_of_turns(x))) for x in (A, T))
    if said > LITTLE * seen:
        return []
    turns = (
        f"the board turns by {np.degrees(seen):.1f} degrees (standard deviation), "
        f"the robot's poses by {np.degrees(said):.2f}"
    )
    radians = fit_scaled(A, series.motion(camera, as_if_radians(T)))
    if radians.angle < FITS[0] or said > STILL * seen:
        remedy = "the robot's angles are radians and were read as degrees; give radians"
        return [Problem("angle_units", "error", f"camera {camera}", turns, remedy)]
    remedy = "record the pose of every picture anew; it seems that one pose was stored for all"
    return [Problem("still", "error", f"camera {camera}", turns, remedy)]


def _reading(series: Series, camera: str, A: FloatArray, T: FloatArray) -> list[Problem]:
    """Whether the poses fit if they are read in another way than they were."""

    def fit(meant: FloatArray, seen: FloatArray = A) -> Fit:
        return fit_scaled(seen, series.motion(camera, meant))

    given, where = fit(T), f"camera {camera}"
    if given.angle < FITS[0] and given.distance < FITS[1]:
        return []
    fits = [(fit(reading.meant), reading) for reading in _readings(series, camera, A, T)]
    # A wrong order of quaternions turns as inverted poses do, so only positions tell them apart.
    right = [found for found in fits if found[0].angle < FITS[0]]
    if right:
        best, reading = min(right, key=lambda found: found[0].distance)
        if best.distance < given.distance / BETTER or given.angle > BETTER * best.angle:
            told = f"{_off(given)} as given, {_off(best)} if {reading.problem}"
            return [Problem(reading.kind, "error", where, told, reading.remedy)]
    n = len(T) - 1
    for which, other in (("before", fit(T[:n], A[1:])), ("after", fit(T[1:], A[:n]))):
        if n > LEAST and other.angle < FITS[0] and other.distance < FITS[1]:
            told = f"{_off(given)} as given; each picture fits the pose {which} its own"
            remedy = "wait until the arm stands, then take picture and pose together"
            return [Problem("out_of_step", "error", where, told, remedy)]
    if given.angle < FITS[0]:
        return []
    return [
        Problem("unexplained", "error", where, f"pictures and poses do not fit: {_off(given)}", UNEXPLAINED)
    ]


def _off(fit: Fit) -> str:
    return f"{np.degrees(fit.angle):.1f} degrees and {1000 * fit.distance:.0f} mm off"


UNEXPLAINED = (
    "see that every picture belongs to its pose, that poses are T_base_gripper with rotations in radians, "
    "that the board cannot slip in the hand or on the table, and that nobody moved camera or base meanwhile"
)


def _readings(series: Series, camera: str, A: FloatArray, T: FloatArray) -> list[_Reading]:
    def reordered(places: int) -> FloatArray:
        quaternions = Rotation.from_matrix(T[:, :3, :3]).as_quat()
        return se3.make(Rotation.from_quat(np.roll(quaternions, places, axis=1)).as_matrix(), T[:, :3, 3])

    order = "write quaternions as x y z w"
    first, last = "w x y z and were read as x y z w", "x y z w and were read as w x y z"
    radians = "the angles are degrees and were read as radians"
    return [
        _Reading("inverted", se3.invert(T), *_inverted(series, camera, A, T)),
        _Reading("quaternion_order", reordered(-1), f"the quaternions are {first}", order),
        _Reading("quaternion_order", reordered(1), f"the quaternions are {last}", order),
        _Reading("angle_units", as_if_degrees(A, T, series, camera), radians, "give radians"),
    ]


def _inverted(series: Series, camera: str, A: FloatArray, T: FloatArray) -> tuple[str, str]:
    """Inverted poses and a camera mounted elsewhere are the same equation; lengths tell them apart."""
    fit = fit_scaled(A, series.motion(camera, se3.invert(T)))
    on_hand = series.cameras[camera].mount == "hand"
    # What is on the hand is near the gripper; what is not is at arm's length from the base.
    to_camera, to_board = np.linalg.norm(fit.X[:3, 3]), np.linalg.norm(fit.Y[:3, 3])
    if (to_camera > to_board) == on_hand:
        mount = (
            "beside the robot and the board in the hand"
            if on_hand
            else "on the hand and the board on the table"
        )
        remedy = (
            "set mount and board_on accordingly; if they are right, poses are inverted: give T_base_gripper"
        )
        return f"the camera is {mount}", remedy
    remedy = "give T_base_gripper, the gripper's pose in the frame of the arm's base"
    return "the poses are inverted (T_gripper_base)", remedy


def _scale(series: Series, where: str, fit: Fit) -> list[Problem]:
    if abs(fit.scale - 1) < SCALE_OFF:
        if fit.distance > FITS[1]:
            problem = f"pictures and poses do not fit: {1000 * fit.distance:.0f} mm off in the median"
            return [Problem("unexplained", "error", where, problem, UNEXPLAINED)]
        return []
    for factor, unit in _UNITS.items():
        if np.isclose(fit.scale, factor, rtol=0.15):
            problem = f"the robot's positions fit if they are {unit}"
            return [Problem("robot_units", "error", where, problem, "give positions in metres")]
    if fit.scale <= 0.05 or fit.distance > FITS[1]:
        problem = f"pictures and poses do not fit (lengths differ by a factor of {fit.scale:.3g})"
        return [Problem("unexplained", "error", where, problem, UNEXPLAINED)]
    return [wrong_square(series, where, 1 / fit.scale)]


def wrong_square(series: Series, where: str, scale: float) -> Problem:
    """The board's squares are `scale` times as large as said."""
    said = 1000 * series.board.square
    problem = f"squares of {said:.2f} mm do not fit the robot's motions, squares of {scale * said:.2f} mm do"
    remedy = (
        "measure the printed squares (over several of them) and give square and marker as measured, in metres"
    )
    return Problem("square_size", "error", where, problem, remedy)
