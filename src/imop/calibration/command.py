"""`imop calibrate`: print a board, take pictures, find where the cameras are, and check it later."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro
from tyro.conf import Positional

from imop.errors import InvalidInput
from imop.files import writable_folder
from imop.terminal import console, status, track

if TYPE_CHECKING:
    from imop.calibration.board import Board
    from imop.calibration.clouds import RobotDistance
    from imop.calibration.collect import Rig
    from imop.calibration.folder import Recording
    from imop.calibration.problems import Problem
    from imop.calibration.result import Calibration
    from imop.calibration.series import Series
    from imop.setup.setup import Setup

_LEAST, _TRIES = 15, 60
_LOOKED_AT = 3


@dataclass(frozen=True)
class BoardSizes:
    """How the board is made; by default as `Board` is, which takes numpy to import."""

    columns: int = 8
    """squares in a row"""
    rows: int = 6
    """rows of squares"""
    square: float = 0.028
    """edge of a square, metres, as measured on the print"""
    marker: float = 0.021
    """edge of a marker, metres"""
    dictionary: str = "DICT_4X4_50"
    """OpenCV's name of the set of markers"""

    def board(self) -> "Board":
        """The board of these sizes."""
        from imop.calibration.board import Board

        return Board(self.columns, self.rows, self.square, self.marker, self.dictionary)


@dataclass(frozen=True)
class Draw:
    """Draw a board to be printed, with its sizes on it."""

    out: Path
    """.pdf or .png"""
    sizes: Annotated[BoardSizes, tyro.conf.OmitArgPrefixes]

    def __call__(self) -> int:
        """Run it."""
        from imop.calibration.board import save_board

        board = self.sizes.board()
        width, height = save_board(board, self.out)
        console.print(f"{board}, on a sheet of {1000 * width:.0f} x {1000 * height:.0f} mm", soft_wrap=True)
        console.print(self.out)
        return 0


@dataclass(frozen=True)
class Collect:
    """Take pictures of the board from different sides, with the robot's pose at each."""

    folder: Positional[Path]
    """where to; what is there is continued"""
    sizes: Annotated[BoardSizes, tyro.conf.OmitArgPrefixes]
    rig: str = ""
    """module:function that returns an imop.calibration.collect.Rig: robot, cameras, where they are mounted"""
    simulated: Literal["", "beside", "hand"] = ""
    """instead of a rig: the simulated Panda with cameras left and right beside it, or wrist on its hand"""
    knock: str = ""
    """camera of the simulated Panda that is moved by 5 mm and 1 degree, to see how that is noticed"""
    board_on: Literal["hand", "table"] = "table"
    """where the board is: in the hand for cameras beside the robot, on the table for cameras on the hand"""
    move: bool = False
    """let the robot go around where it is now; otherwise you guide it, and press Enter for each picture"""
    count: int = _LEAST
    """how many pictures there shall be"""
    seed: int = 0
    """of the poses"""

    def __call__(self) -> int:
        """Run it."""
        import numpy as np

        from imop.calibration.collect import collect, proposed_poses, start_recording

        if bool(self.rig) == bool(self.simulated):
            raise InvalidInput(
                "rig", "given together with simulated" if self.rig else "missing", "one of the two"
            )
        writable_folder(self.folder, "folder")
        rng = np.random.default_rng(self.seed)
        if self.simulated:
            from imop.calibration.refine import moved
            from imop.calibration.simulated import simulated_cell

            knock = {self.knock: moved(np.array([0.0, np.radians(1.0), 0.0, 0.005, 0.0, 0.0]))}
            cell = simulated_cell(self.simulated, self.sizes.board(), knock if self.knock else None)
            cell.rig.robot.move_to(cell.T_base_gripper)
            rig, board_on, move = cell.rig, cell.board_on, True
        else:
            rig, board_on, move = find_rig(self.rig), self.board_on, self.move
        recording = start_recording(self.folder, rig, self.sizes.board(), board_on)
        if not move:
            return self._guided(recording, rig)
        T, ahead = rig.robot.state().T_base_gripper, _ahead(recording, rig)
        poses = [T, *proposed_poses(T, rng, _TRIES, ahead)]
        done = collect(
            recording,
            rig,
            poses,
            self.count,
            lambda i, what, why: console.print(f"pose {i}: {what} {why}".rstrip()),
        )
        rig.robot.move_to(T)
        return _say_collected(done, self.count)

    def _guided(self, recording: "Recording", rig: "Rig") -> int:
        from imop.calibration.collect import shoot

        console.print(
            "Guide the hand to where the cameras see the whole board; turn it by 20 to 40 degrees between."
        )
        while len(recording.shots) < self.count:
            answer = console.input(f"{len(recording.shots)} of {self.count}: Enter takes a picture, q ends ")
            if answer.strip() == "q":
                break
            recording, what = shoot(recording, rig)
            console.print(what)
        return _say_collected(recording, self.count)


@dataclass(frozen=True)
class Solve:
    """Find where the cameras are from a folder of pictures and poses, and say how well that is known."""

    folder: Positional[Path]
    """with series.json, from `imop calibrate collect` or your own"""
    setup: Path | None = None
    """set-up file that says where the arm's base is; without it the base is the world"""
    robot: Literal["", "panda", "iiwa", "iiwa14", "ur5e"] = ""
    """whose shape is compared with depth images; by default that of the set-up"""
    out: Path | None = None
    """file for the result; calibration.json in the folder if not given"""

    def __call__(self) -> int:
        """Run it."""
        from imop.calibration.calibrate import calibrate
        from imop.calibration.folder import read_recording
        from imop.calibration.problems import NotCalibrated
        from imop.calibration.result import save_calibration
        from imop.setup.file import load_setup

        recording = read_recording(self.folder)
        setup = None if self.setup is None else load_setup(self.setup)
        series = recording.series(lambda numbers: track(numbers, "looking for the board"))
        try:
            with status("calibrating"):
                calibration = calibrate(series, None if setup is None else setup.robot.T_world_base)
        except NotCalibrated as error:
            return _say(error.problems)
        out = self.out or self.folder / "calibration.json"
        save_calibration(calibration, out)
        _say_quality(calibration)
        shape = _shape(self.robot, setup, calibration)
        problems = [*calibration.problems, *_look(recording, series, calibration, shape)]
        console.print(out)
        return _say(problems)


@dataclass(frozen=True)
class Check:
    """Whether cameras are still where they were calibrated, by new pictures of the board."""

    folder: Positional[Path]
    """with series.json of the new pictures"""
    calibration: Path
    """what `imop calibrate solve` wrote"""
    setup: Path | None = None
    """set-up file whose robot's shape is compared with depth images"""
    robot: Literal["", "panda", "iiwa", "iiwa14", "ur5e"] = ""
    """the same without a set-up"""

    def __call__(self) -> int:
        """Run it."""
        from imop.calibration.folder import read_recording
        from imop.calibration.knocked import moved_since
        from imop.calibration.problems import NotCalibrated
        from imop.calibration.result import load_calibration
        from imop.setup.file import load_setup

        setup = None if self.setup is None else load_setup(self.setup)
        calibration, recording = load_calibration(self.calibration), read_recording(self.folder)
        series = recording.series(lambda numbers: track(numbers, "looking for the board"))
        try:
            with status("checking"):
                moved, problems = moved_since(calibration, series)
        except NotCalibrated as error:
            return _say(error.problems)
        for name, how in moved.items():
            console.print(f"{name}: {how}", soft_wrap=True)
        shape = _shape(self.robot, setup, calibration)
        return _say([*problems, *_look(recording, series, calibration, shape)])


def calibrate(
    do: Annotated[
        Annotated[Draw, tyro.conf.subcommand("board", prefix_name=False)]
        | Annotated[Collect, tyro.conf.subcommand("collect", prefix_name=False)]
        | Annotated[Solve, tyro.conf.subcommand("solve", prefix_name=False)]
        | Annotated[Check, tyro.conf.subcommand("check", prefix_name=False)],
        tyro.conf.OmitArgPrefixes,
    ],
) -> int:
    """Find where cameras stand, with a printed board; docs/real_robot/calibration.md leads through it."""
    return do()


def find_rig(name: str) -> "Rig":
    """The rig that a function returns: "module:function", or an entry point of the group imop.rigs.

    Raises:
        InvalidInput: if there is none, or it returns something else.
    """
    from imop import plugins
    from imop.calibration.collect import Rig

    accepted = "module:function that returns an imop.calibration.collect.Rig"
    make = plugins.find("rig", name, "imop.rigs")
    if not callable(make) or not plugins.takes_nothing(make):
        raise InvalidInput("rig", name, accepted)
    rig = make()
    if not isinstance(rig, Rig):
        raise InvalidInput("rig", f"{name} returns a {type(rig).__name__}", accepted)
    return rig


def _ahead(recording: "Recording", rig: "Rig") -> float:
    """Metres from the fingers to the board on the table; 0 if the hand holds it."""
    from imop.calibration.detect import board_pose, detect_corners

    if recording.board_on == "hand":
        return 0.0
    for name, camera in recording.cameras.items():
        corners = detect_corners(recording.board, rig.cameras[name].capture().rgb)
        if camera.mount == "hand" and corners is not None and camera.intrinsics is not None:
            return float(board_pose(recording.board, corners, camera.intrinsics)[2, 3])
    raise InvalidInput(
        "board", "no camera on the hand sees it now", "the hand where its camera sees the whole board"
    )


def _say_collected(recording: "Recording", count: int) -> int:
    console.print(f"{len(recording.shots)} pictures in {recording.folder}")
    return 0 if len(recording.shots) >= count else 1


def _say(problems: "Sequence[Problem]") -> int:
    """Print problems; the exit code."""
    for problem in problems:
        console.print(str(problem), style="red" if problem.severity == "error" else "yellow", soft_wrap=True)
    if not problems:
        console.print("nothing is wrong", style="green")
    return 1 if any(problem.severity == "error" for problem in problems) else 0


def _say_quality(calibration: "Calibration") -> None:
    for name, found in calibration.cameras.items():
        q, p = found.quality, (1000 * found.T_mount_camera[:3, 3]).round(1)
        frame = "gripper" if found.camera.mount == "hand" else "arm's base"
        lines = (
            f"{name}: at ({p[0]}, {p[1]}, {p[2]}) mm in the frame of the {frame}, known to "
            f"{q.millimetres_off:.2f} mm and {q.degrees_off:.3f} degrees",
            f"  {q.pictures} pictures; corners are {q.pixels:.2f} px and {q.millimetres:.2f} mm off, worst "
            f"in {q.worst_picture} ({q.worst_pixels:.2f} px)",
            f"  without one picture it moves by at most {q.spread_millimetres:.2f} mm and "
            f"{q.spread_degrees:.3f} degrees",
        )
        for line in lines:
            console.print(line, soft_wrap=True)


def _shape(robot: str, setup: "Setup | None", calibration: "Calibration") -> "RobotDistance | None":
    """The arm's surface, of a set-up or by its name; None without either, or if its model is not here."""
    from imop.errors import MissingExtra
    from imop.setup.arm import arm_of, known_arm

    try:
        if robot:
            return known_arm(robot, calibration.T_world_base).self_filter.distances
        return None if setup is None else arm_of(setup).self_filter.distances
    except MissingExtra as error:
        console.print(f"the robot's shape is not compared: {error}", soft_wrap=True)
        return None


def _look(
    recording: "Recording", series: "Series", calibration: "Calibration", shape: "RobotDistance | None"
) -> "list[Problem]":
    """Write overlay pictures, and compare depth images, where there are any."""
    from imop.calibration.overlay import draw_overlay, save_overlay

    for name in series.cameras:
        shots = [i for i, shot in enumerate(recording.shots) if name in shot.images]
        some = shots[:: max(1, len(shots) // _LOOKED_AT)][:_LOOKED_AT]
        pictures = {f"{i}": draw_overlay(recording.rgb(i, name), calibration, series, i, name) for i in some}
        if pictures:
            path = recording.folder / f"overlay_{name}.png"
            save_overlay(pictures, path)
            console.print(path)
    return _clouds(recording, calibration, shape)


def _clouds(
    recording: "Recording", calibration: "Calibration", shape: "RobotDistance | None"
) -> "list[Problem]":
    from imop.calibration.clouds import check_robot, check_views

    observations = recording.observations(calibration)
    observations = observations[:: max(1, len(observations) // _LOOKED_AT)][:_LOOKED_AT]
    if not observations:
        console.print("no depth images: neither views nor the robot's shape were compared")
        return []
    with status("comparing views"):
        views, problems = check_views(observations)
    for name, off in views.items():
        console.print(f"{name} against the other views: {off}", soft_wrap=True)
    if shape is not None:
        with status("comparing with the robot's shape"):
            robot, more = check_robot(observations, shape)
        for name, off in robot.items():
            console.print(f"{name} against the robot's shape: {off}", soft_wrap=True)
        problems = [*problems, *more]
    return problems
