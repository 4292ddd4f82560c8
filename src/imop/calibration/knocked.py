"""Whether cameras are still where they were when they were calibrated."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from imop.calibration.calibrate import Prepared, moving_cameras, prepare
from imop.calibration.diagnose import diagnose
from imop.calibration.problems import NotCalibrated, Problem
from imop.calibration.refine import Poses, Refined, refine
from imop.calibration.result import Calibration
from imop.calibration.series import Series
from imop.errors import InvalidInput
from imop.geometry import se3

FAR = 2.5, 0.5
"""Millimetres and degrees from which a camera was moved; half of the knocks that have to be noticed."""
CHANCE = 30.0
"""Squared Mahalanobis distance (six degrees of freedom) from which a motion is no chance; 1 in 25,000."""
ENOUGH = 6
"""Pictures with which the board may have been fixed anew meanwhile."""


@dataclass(frozen=True)
class Moved:
    """How far a camera is from where it was.

    Attributes:
        millimetres: between its positions.
        degrees: between its rotations.
        millimetres_off: standard error of its position.
        degrees_off: of its rotation.
        chance: squared Mahalanobis distance of the motion, six degrees of freedom.
        unnoticed: millimetres of a shift in the least visible direction that could pass for chance.
    """

    millimetres: float
    degrees: float
    millimetres_off: float
    degrees_off: float
    chance: float
    unnoticed: float

    def __str__(self) -> str:
        return (
            f"{self.millimetres:.1f} +- {self.millimetres_off:.1f} mm and "
            f"{self.degrees:.2f} +- {self.degrees_off:.2f} degrees from where it was calibrated"
        )

    @property
    def knocked(self) -> bool:
        """Whether it moved by more than `FAR`, and not by chance."""
        return self.chance > CHANCE and (self.millimetres > FAR[0] or self.degrees > FAR[1])

    @property
    def unsure(self) -> bool:
        """Whether a shift by twice `FAR` could pass for chance."""
        return self.unnoticed > 2 * FAR[0]


def moved_since(calibration: Calibration, series: Series) -> tuple[dict[str, Moved], list[Problem]]:
    """How far the cameras that see the board in a new series are from where they were calibrated.

    With `ENOUGH` pictures from different sides the board may have been fixed anew since the calibration. With
    fewer it has to be where it was; then one picture is enough.

    Args:
        calibration: where the cameras were.
        series: what they see now; their intrinsics are those of the calibration.

    Returns:
        Each camera's motion, and the problems that were found.

    Raises:
        InvalidInput: if the series has a camera that was not calibrated, if no picture shows the board, or if
            too few show another board than the one of the calibration.
        NotCalibrated: if pictures and poses do not fit each other.
    """
    prepared = prepare(_with_intrinsics(calibration, series))
    series = prepared.series
    start = Poses(
        {n: calibration.cameras[n].T_mount_camera for n in series.cameras}, calibration.T_place_board
    )
    free = _determined(prepared)
    if not free and (series.board_on != calibration.board_on or series.board != calibration.board):
        problem = "too few pictures, or all from one side, for another board than that of the calibration"
        raise InvalidInput(
            "shots", problem, f"the same board where it was, or {ENOUGH} pictures from different sides"
        )
    refined = refine(series, prepared.pictures, start, fixed_board=not free)
    moved = {name: _moved(calibration, refined, name) for name in series.cameras}
    return moved, [problem for name, how in moved.items() for problem in _problems(name, how, free)]


def _with_intrinsics(calibration: Calibration, series: Series) -> Series:
    for name in series.cameras:
        if name not in calibration.cameras:
            raise InvalidInput("cameras", name, "one that was calibrated: " + ", ".join(calibration.cameras))
    seen = {name for shot in series.shots for name in shot.corners}
    if not seen:
        raise InvalidInput("shots", "no picture shows the board", "at least one that does")
    return replace(series, cameras={n: calibration.cameras[n].camera for n in series.cameras if n in seen})


def _determined(prepared: Prepared) -> bool:
    """Whether the board's pose can be found together with the cameras'."""
    for name in moving_cameras(prepared.series):
        poses = prepared.T_camera_board[name]
        if len(poses) < ENOUGH:
            continue
        problems = diagnose(prepared.series, name, list(poses), np.stack(list(poses.values())))
        wrong = [p for p in problems if p.severity == "error" and p.kind != "alike"]
        if wrong:
            raise NotCalibrated(wrong)
        if not any(p.kind == "alike" for p in problems):
            return True
    return False


def _moved(calibration: Calibration, refined: Refined, name: str) -> Moved:
    before, now = calibration.cameras[name], refined.poses.cameras[name]
    known = before.quality
    at = 6 * list(refined.poses.cameras).index(name)
    block = np.s_[at : at + 6, at : at + 6]
    # A few pictures do not tell how much they scatter; those of the calibration did.
    noise = known.common * max(known.corner_pixels, refined.deviation) ** 2
    covariance = noise * refined.independent[block]
    calibrated = np.repeat([np.radians(known.degrees_off), known.millimetres_off / 1000], 3) ** 2 / 3
    covariance = covariance + np.diag(calibrated)
    T = se3.invert(before.T_mount_camera) @ now
    twist = np.concatenate([Rotation.from_matrix(T[:3, :3]).as_rotvec(), T[:3, 3]])
    information = np.linalg.inv(covariance)
    least = float(np.linalg.eigvalsh(information[3:, 3:])[0])
    variance = np.diag(covariance)
    return Moved(
        1000 * float(np.linalg.norm(twist[3:])),
        float(np.degrees(np.linalg.norm(twist[:3]))),
        1000 * float(np.sqrt(variance[3:].sum())),
        float(np.degrees(np.sqrt(variance[:3].sum()))),
        float(twist @ information @ twist),
        1000 * float(np.sqrt(CHANCE / least)),
    )


def _problems(name: str, moved: Moved, free: bool) -> list[Problem]:
    where = f"camera {name}"
    if moved.knocked:
        what = "it is" if free else "it, or the board, is"
        problem = f"{what} {moved}"
        remedy = (
            "fix it and calibrate again"
            if free
            else "if the board was not touched, fix it and calibrate again"
        )
        return [Problem("knocked", "error", where, problem, remedy)]
    if moved.unsure:
        remedy = "take more pictures, with the hand turned about two axes, to tell whether it was knocked"
        return [
            Problem(
                "imprecise",
                "warning",
                where,
                f"it is {moved}; a shift of {moved.unnoticed:.0f} mm would not be noticed",
                remedy,
            )
        ]
    return []
