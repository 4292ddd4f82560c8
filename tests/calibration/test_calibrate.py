from dataclasses import replace

import numpy as np
import pytest

from imop.calibration.board import Board
from imop.calibration.calibrate import calibrate, prepare, start_poses
from imop.calibration.detect import project
from imop.calibration.problems import NotCalibrated
from imop.calibration.refine import moved, refine
from imop.calibration.series import Corners, Series, Shot
from imop.calibration.synthetic import INTRINSICS, Noise, random_poses
from imop.errors import InvalidInput
from imop.geometry import se3

from .rigs import MOUNTS, gripper_poses, rig, with_poses

SHIFT = se3.make(se3.euler(0.3, -0.2, 1.0), (0.4, -0.1, 0.2))


@pytest.mark.parametrize("mount", MOUNTS)
@pytest.mark.parametrize("seed", range(2))
def test_fifteen_pictures_tell_where_the_camera_is(seed, mount):
    truth, series = rig(seed, mount)
    found = calibrate(series)
    camera = found.cameras["camera"]
    assert se3.translation_distance(camera.T_mount_camera, truth.T_mount_camera) < 0.0005
    assert se3.rotation_distance(camera.T_mount_camera, truth.T_mount_camera) < np.radians(0.06)
    assert np.allclose(found.T_place_board, truth.T_place_board, atol=0.002)
    assert not found.problems


def test_its_own_estimate_of_the_error_is_about_right():
    noise = Noise(0.3, 0.0002, np.radians(0.02))
    ratios = []
    for seed in range(3):
        truth, series = rig(seed, MOUNTS[seed % 2], noise=noise)
        camera = calibrate(series).cameras["camera"]
        off = 1000 * se3.translation_distance(camera.T_mount_camera, truth.T_mount_camera)
        ratios.append(off / camera.quality.millimetres_off)
    assert 0.3 < np.sqrt(np.mean(np.square(ratios))) < 2.0


def test_another_base_frame_moves_cameras_beside_the_robot_with_it():
    _, series = rig(0, "world")
    elsewhere = calibrate(with_poses(series, SHIFT @ gripper_poses(series)))
    here = calibrate(series).cameras["camera"].T_mount_camera
    assert np.allclose(elsewhere.cameras["camera"].T_mount_camera, SHIFT @ here, atol=1e-5)


def test_another_gripper_frame_moves_cameras_on_the_hand_with_it():
    _, series = rig(0, "hand")
    elsewhere = calibrate(with_poses(series, gripper_poses(series) @ SHIFT))
    here = calibrate(series).cameras["camera"].T_mount_camera
    assert np.allclose(elsewhere.cameras["camera"].T_mount_camera, se3.invert(SHIFT) @ here, atol=1e-5)


def test_the_order_of_pictures_does_not_matter():
    _, series = rig(0, "world")
    backwards = calibrate(replace(series, shots=series.shots[::-1]))
    here = calibrate(series).cameras["camera"].T_mount_camera
    assert np.allclose(backwards.cameras["camera"].T_mount_camera, here, atol=1e-6)


def test_the_world_is_where_the_base_is_said_to_stand():
    _, series = rig(0, "world")
    found = calibrate(series, SHIFT)
    expected = SHIFT @ found.cameras["camera"].T_mount_camera
    assert np.allclose(found.T_world_camera("camera", np.eye(4)), expected)


@pytest.mark.parametrize("mount", MOUNTS)
def test_opencvs_solvers_alone_come_near_and_the_refinement_comes_nearer(mount):
    truth, series = rig(1, mount)
    prepared = prepare(series)
    start = start_poses(prepared)
    refined = refine(prepared.series, prepared.pictures, start)
    before = se3.translation_distance(start.cameras["camera"], truth.T_mount_camera)
    after = se3.translation_distance(refined.poses.cameras["camera"], truth.T_mount_camera)
    assert after < before / 3 < 0.01


def test_one_wrong_picture_is_named_and_does_no_harm():
    truth, series = rig(2, "world")
    shots = list(series.shots)
    shots[4] = replace(shots[4], T_base_gripper=shots[4].T_base_gripper @ moved(np.full(6, 0.02)))
    found = calibrate(replace(series, shots=shots))
    assert [problem.kind for problem in found.problems] == ["outlier"]
    assert "shot 4" in found.problems[0].where
    assert se3.translation_distance(found.cameras["camera"].T_mount_camera, truth.T_mount_camera) < 0.001


def test_a_camera_that_was_moved_between_two_pictures_is_noticed():
    truth, series = rig(0, "world", shots=8)
    rng = np.random.default_rng(9)
    later = replace(truth, T_mount_camera=truth.T_mount_camera @ moved(np.array([0, 0.0175, 0, 0.005, 0, 0])))
    after = later.series(random_poses(rng, later, 8), rng, Noise(0.3))
    with pytest.raises(NotCalibrated) as error:
        calibrate(replace(series, shots=[*series.shots, *after.shots]))
    (problem,) = error.value.problems
    assert problem.kind == "knocked"
    assert "shot 7 and shot 0" in problem.problem


def test_intrinsics_are_found_where_none_are_given():
    truth, series = rig(0, "world")
    K = series.cameras["camera"].intrinsics
    found = calibrate(replace(series, cameras={"camera": replace(series.cameras["camera"], intrinsics=None)}))
    camera = found.cameras["camera"]
    assert np.allclose(camera.camera.intrinsics, K, atol=4.0)
    assert se3.translation_distance(camera.T_mount_camera, truth.T_mount_camera) < 0.005


def test_lenses_that_bend_lines_are_straightened():
    import cv2

    truth, series = rig(0, "world")
    camera = replace(series.cameras["camera"], distortion=np.array([-0.2, 0.05, 0.001, -0.001]))

    def bent(corners):
        K = camera.intrinsics
        rays = np.column_stack([corners.pixels, np.ones(len(corners.ids))]) @ np.linalg.inv(K).T
        pixels, _ = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), K, camera.distortion)
        return Corners(corners.ids, pixels.reshape(-1, 2))

    shots = [replace(shot, corners={"camera": bent(shot.corners["camera"])}) for shot in series.shots]
    found = calibrate(replace(series, cameras={"camera": camera}, shots=shots)).cameras["camera"]
    assert se3.translation_distance(found.T_mount_camera, truth.T_mount_camera) < 0.0005


def both_cameras(board_on="table"):
    """A camera on the hand and one beside the robot, which both see a board on the table."""
    truth, series = rig(0, "hand")
    T_base_camera = (
        truth.T_place_board @ se3.make(p=(0.1, 0.08, -0.6)) @ moved(np.array([0.3, 0.2, 0.1, 0, 0, 0]))
    )
    rng, points = np.random.default_rng(0), series.board.corners
    pixels = project(se3.invert(T_base_camera) @ truth.T_place_board, points, INTRINSICS)
    shots = [
        Shot(
            shot.T_base_gripper,
            shot.corners
            | {"beside": Corners(np.arange(len(points)), pixels + rng.normal(0, 0.3, pixels.shape))},
        )
        for shot in series.shots
    ]
    cameras = series.cameras | {"beside": replace(series.cameras["camera"], mount="world")}
    return T_base_camera, Series(series.board, board_on, cameras, shots)


def test_a_camera_on_the_hand_tells_a_camera_beside_the_robot_where_the_board_is():
    T_base_camera, series = both_cameras()
    found = calibrate(series)
    assert se3.translation_distance(found.cameras["beside"].T_mount_camera, T_base_camera) < 0.002
    assert se3.rotation_distance(found.cameras["beside"].T_mount_camera, T_base_camera) < np.radians(0.3)


def test_a_board_on_the_table_tells_nothing_to_cameras_beside_the_robot_alone():
    _, series = both_cameras()
    shots = [replace(shot, corners={"beside": shot.corners["beside"]}) for shot in series.shots]
    alone = Series(series.board, "table", {"beside": series.cameras["beside"]}, shots)
    with pytest.raises(NotCalibrated, match="no camera on the hand"):
        calibrate(alone)


def test_a_camera_that_moves_with_the_board_is_refused():
    _, series = rig(0, "hand")
    with pytest.raises(InvalidInput, match="both on the hand"):
        replace(series, board_on="hand")


def test_corners_that_the_board_does_not_have_are_refused():
    _, series = rig(0, "hand")
    with pytest.raises(InvalidInput, match="on this board"):
        replace(series, board=Board(4, 4))
