from dataclasses import replace

import numpy as np
import pytest

from imop.calibration.calibrate import calibrate
from imop.calibration.knocked import moved_since
from imop.calibration.problems import NotCalibrated
from imop.calibration.synthetic import Noise, knocked, random_poses
from imop.errors import InvalidInput
from imop.geometry import se3

from .rigs import MOUNTS, gripper_poses, rig, with_poses

NOISE = Noise(0.3, 0.0001, np.radians(0.01))


@pytest.fixture(scope="module", params=MOUNTS)
def before(request):
    truth, series = rig(0, request.param, noise=NOISE)
    return truth, calibrate(series)


def later(truth, shots, seed=0):
    rng = np.random.default_rng(seed)
    return truth.series(random_poses(rng, truth, shots), rng, NOISE)


def kinds(calibration, series):
    return [problem.kind for problem in moved_since(calibration, series)[1]]


@pytest.mark.parametrize("shots", [3, 8])
@pytest.mark.parametrize(("distance", "degrees"), [(0.005, 0.0), (0.0, 1.0)])
@pytest.mark.parametrize("seed", range(2))
def test_a_knock_is_noticed(before, seed, distance, degrees, shots):
    truth, calibration = before
    now = knocked(truth, np.random.default_rng(seed), distance, np.radians(degrees))
    moved, problems = moved_since(calibration, later(now, shots, seed))
    assert [problem.kind for problem in problems] == ["knocked"]
    assert abs(moved["camera"].millimetres - 1000 * distance) < 2.5
    assert abs(moved["camera"].degrees - degrees) < 0.5


@pytest.mark.parametrize("shots", [1, 3, 8])
@pytest.mark.parametrize("seed", range(2))
def test_no_knock_is_none(before, seed, shots):
    truth, calibration = before
    assert "knocked" not in kinds(calibration, later(truth, shots, seed))


def test_a_board_that_was_fixed_anew_is_no_knock_if_there_are_pictures_enough(before):
    truth, calibration = before
    now = replace(truth, T_place_board=truth.T_place_board @ se3.make(se3.euler(z=0.2), (0.02, 0.0, 0.0)))
    assert kinds(calibration, later(now, 8)) == []
    # With few pictures nothing can be told apart, and the message says so.
    _, (problem,) = moved_since(calibration, later(now, 3))
    assert problem.kind == "knocked" and "or the board" in problem.problem


def test_few_pictures_do_not_tell_of_another_board(before):
    truth, calibration = before
    other = replace(calibration, board=replace(calibration.board, square=0.03))
    with pytest.raises(InvalidInput, match="another board"):
        moved_since(other, later(truth, 3))


def test_pictures_without_board_and_unknown_cameras_are_refused(before):
    truth, calibration = before
    series = later(truth, 3)
    with pytest.raises(InvalidInput, match="no picture"):
        moved_since(calibration, replace(series, shots=[replace(shot, corners={}) for shot in series.shots]))
    strange = {"other": calibration.cameras["camera"]}
    with pytest.raises(InvalidInput, match="calibrated"):
        moved_since(replace(calibration, cameras=strange), series)


def test_mistakes_in_the_new_poses_are_no_knock(before):
    truth, calibration = before
    series = later(truth, 8)
    with pytest.raises(NotCalibrated, match="inverted"):
        moved_since(calibration, with_poses(series, se3.invert(gripper_poses(series))))
