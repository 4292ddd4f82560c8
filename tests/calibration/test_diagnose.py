"""Each mistake is named, on the hand and beside it, and nothing is said where there is none."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imop.calibration.board import Board
from imop.calibration.calibrate import calibrate
from imop.calibration.problems import NotCalibrated
from imop.calibration.synthetic import Noise
from imop.errors import InvalidInput
from imop.geometry import se3

from .rigs import MOUNTS, gripper_poses, rig, with_poses

ROBOT = Noise(0.3, 0.0002, np.radians(0.02))


def in_millimetres(T):
    T = T.copy()
    T[:, :3, 3] *= 1000
    return T


def reread(change):
    """Poses whose rotations were read in another way than they were written."""

    def read(T):
        return se3.make(change(Rotation.from_matrix(T[:, :3, :3])).as_matrix(), T[:, :3, 3])

    return read


POSES = {
    "inverted": ("inverted", se3.invert),
    "millimetres": ("robot_units", in_millimetres),
    "written w x y z": (
        "quaternion_order",
        reread(lambda R: Rotation.from_quat(np.roll(R.as_quat(), 1, axis=1))),
    ),
    "read w x y z": (
        "quaternion_order",
        reread(lambda R: Rotation.from_quat(R.as_quat(), scalar_first=True)),
    ),
    "radians as degrees": (
        "angle_units",
        reread(lambda R: Rotation.from_rotvec(np.radians(R.as_rotvec()))),
    ),
    "degrees as radians": (
        "angle_units",
        reread(lambda R: Rotation.from_rotvec(np.degrees(R.as_rotvec()))),
    ),
    "always the same": ("still", lambda T: np.repeat(T[:1], len(T), axis=0)),
    "the one before": ("out_of_step", lambda T: np.roll(T, 1, axis=0)),
    "the one after": ("out_of_step", lambda T: np.roll(T, -1, axis=0)),
    "of another robot": ("unexplained", lambda T: np.random.default_rng(0).permutation(T)),
}


def told(series):
    """The kinds of errors, and their whole text."""
    with pytest.raises(NotCalibrated) as error:
        calibrate(series)
    return {problem.kind for problem in error.value.problems}, str(error.value)


@pytest.mark.parametrize("mount", MOUNTS)
@pytest.mark.parametrize("mistake", POSES)
def test_poses_that_mean_something_else_are_named(mistake, mount):
    kind, change = POSES[mistake]
    _, series = rig(4, mount, noise=ROBOT)
    kinds, text = told(with_poses(series, change(gripper_poses(series))))
    assert kinds == {kind}
    assert "remedy" in text


@pytest.mark.parametrize("mount", MOUNTS)
def test_a_camera_that_is_mounted_elsewhere_is_named(mount):
    _, series = rig(1, mount)
    other = {"world": ("hand", "table"), "hand": ("world", "hand")}[mount]
    cameras = {"camera": replace(series.cameras["camera"], mount=other[0])}
    kinds, text = told(replace(series, cameras=cameras, board_on=other[1]))
    assert kinds == {"inverted"}
    assert {"world": "beside the robot", "hand": "on the hand"}[mount] in text


@pytest.mark.parametrize(("said", "mount"), [(0.020, "world"), (0.0272, "hand"), (0.0285, "world")])
def test_squares_of_another_size_are_named_with_their_size(said, mount):
    _, series = rig(2, mount)
    kinds, text = told(replace(series, board=Board(square=said, marker=0.75 * said)))
    assert kinds == {"square_size"}
    measured = float(text.split("squares of ")[2].split(" mm")[0])
    assert np.isclose(measured, 28.0, rtol=0.01)


def test_intrinsics_of_another_size_are_named():
    _, series = rig(0, "world")
    larger = np.diag([1.5, 1.5, 1.0]) @ series.cameras["camera"].intrinsics
    with pytest.raises(InvalidInput, match="of this image size"):
        replace(series.cameras["camera"], intrinsics=larger)
    larger[:2, 2] = series.cameras["camera"].intrinsics[:2, 2]
    kinds, text = told(
        replace(series, cameras={"camera": replace(series.cameras["camera"], intrinsics=larger)})
    )
    assert kinds == {"intrinsics"}
    assert "not with 922 px" in text


@pytest.mark.parametrize("mount", MOUNTS)
def test_boards_that_look_alike_are_named(mount):
    rng = np.random.default_rng(0)
    truth, _ = rig(0, mount)
    shift = se3.make(p=rng.normal(0, 0.03, (12, 3)))
    about_one = se3.make(Rotation.from_rotvec(np.linspace(-0.5, 0.5, 12)[:, None] * [0, 0, 1]).as_matrix())
    _, good = rig(0, mount, shots=12)
    start = gripper_poses(good)[0]
    for motion, words in ((shift, "hardly turns"), (shift @ about_one, "one axis only")):
        series = truth.series(start @ motion, rng, Noise(0.3))
        kinds, text = told(series)
        assert kinds == {"alike"}
        assert words in text and "two different axes" in text


@pytest.mark.parametrize("mount", MOUNTS)
def test_too_few_pictures_are_an_error_and_few_a_warning(mount):
    _, series = rig(0, mount)
    assert told(replace(series, shots=series.shots[:2]))[0] == {"few"}
    few = calibrate(replace(series, shots=series.shots[:6]))
    assert "few" in {problem.kind for problem in few.problems}


@pytest.mark.parametrize("mount", MOUNTS)
@pytest.mark.parametrize("seed", range(2))
def test_nothing_is_said_where_nothing_is_wrong(seed, mount):
    _, series = rig(seed, mount, noise=Noise(0.3, 0.0001, np.radians(0.01)))
    assert not calibrate(series).problems
