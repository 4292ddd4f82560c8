"""From rendered pictures to poses: the whole way, with real detection."""

import json

import numpy as np
import pytest

from imop.calibration.board import Board
from imop.calibration.clouds import check_robot, check_views
from imop.calibration.collect import proposed_poses
from imop.calibration.detect import board_pose, detect_corners, project
from imop.calibration.refine import moved
from imop.calibration.result import load_calibration
from imop.calibration.simulated import draw_board, simulated_cell
from imop.cli import main
from imop.geometry import se3
from imop.robots.panda import T_WORLD_BASE
from imop.setup.arm import known_arm
from imop.sim.depth_noise import DepthNoise
from imop.types import CameraView, Observation

K = np.array([[615.0, 0.0, 320.0], [0.0, 615.0, 240.0], [0.0, 0.0, 1.0]])
T_BOARD = se3.make(p=(-0.1, -0.08, 0.55)) @ moved(np.array([0.3, -0.4, 0.2, 0.0, 0.0, 0.0]))


def white(depth=0.0):
    return CameraView(
        np.full((480, 640, 3), 200, np.uint8), np.full((480, 640), depth, np.float32), K, np.eye(4)
    )


def test_corners_of_a_drawn_board_are_found_to_a_fraction_of_a_pixel():
    board = Board()
    corners = detect_corners(board, draw_board(white(), board, T_BOARD).rgb)
    assert len(corners.ids) == len(board.corners)
    off = np.linalg.norm(corners.pixels - project(T_BOARD, board.corners, K)[corners.ids], axis=1)
    assert np.median(off) < 0.15 and np.quantile(off, 0.9) < 0.25
    T = board_pose(board, corners, K)
    assert se3.near(T, T_BOARD, 0.001, np.radians(0.3))


def test_a_drawn_board_has_its_depth_and_is_hidden_by_what_is_nearer():
    board = Board()
    drawn = draw_board(white(), board, T_BOARD)
    u, v = np.round(project(T_BOARD, board.corners, K)).astype(int).T
    assert np.allclose(drawn.depth[v, u], se3.apply(T_BOARD, board.corners)[:, 2], atol=0.002)
    hidden = draw_board(white(0.2), board, T_BOARD)
    assert np.array_equal(hidden.rgb, white().rgb)


def test_nothing_is_found_in_a_picture_without_board():
    assert detect_corners(Board(), white().rgb) is None


def imop(*arguments):
    with pytest.raises(SystemExit) as ended:
        main(["calibrate", *(str(a) for a in arguments)])
    return ended.value.code


@pytest.fixture(scope="module")
def on_hand(tmp_path_factory):
    """A folder with pictures of a camera on the hand, and its calibration."""
    folder = tmp_path_factory.mktemp("calibration") / "hand"
    assert imop("collect", folder, "--simulated", "hand", "--count", 6) == 0
    assert imop("solve", folder) == 0
    return folder


def test_commands_lead_from_pictures_to_the_true_pose(on_hand):
    found = load_calibration(on_hand / "calibration.json").cameras["wrist"].T_mount_camera
    truth = simulated_cell("hand").truth.cameras["wrist"]
    assert se3.near(found, truth, 0.002, np.radians(0.3))
    assert (on_hand / "overlay_wrist.png").stat().st_size > 10_000


@pytest.mark.parametrize(("knock", "code", "said"), [("", 0, "nothing is wrong"), ("wrist", 1, "knocked")])
def test_the_check_notices_a_knock_and_nothing_else(on_hand, tmp_path, capsys, knock, code, said):
    arguments = ("--simulated", "hand", "--count", 3, "--seed", 1, "--knock", knock)
    imop("collect", tmp_path / "now", *arguments)
    assert imop("check", tmp_path / "now", "--calibration", on_hand / "calibration.json") == code
    assert said in capsys.readouterr().out


def test_a_wrong_square_is_told_by_the_command(on_hand, capsys):
    path = on_hand / "series.json"
    content = json.loads(path.read_text())
    right = dict(content["board"])
    content["board"] |= {"square": 0.03, "marker": 0.0225}
    path.write_text(json.dumps(content))
    try:
        assert imop("solve", on_hand, "--out", on_hand / "other.json") == 1
        assert not (on_hand / "other.json").exists()
        assert "squares of 28.0" in capsys.readouterr().out
    finally:
        path.write_text(json.dumps(content | {"board": right}))


def seen_by_cell(knock):
    """What both cameras of a cell see, with the poses that they had before the knock."""
    truth = simulated_cell("beside").truth
    cell = simulated_cell("beside", knocked={"left": knock}, noise=DepthNoise.of_d415())
    arm, observations = cell.rig.robot, []
    for T in proposed_poses(cell.T_base_gripper, np.random.default_rng(0), 2):
        assert arm.move_to(T).done
        state = arm.state()
        views = {n: f.seen_from(T_WORLD_BASE @ truth.cameras[n]) for n, f in cell.rig.capture().items()}
        observations.append(
            Observation(
                views, T_WORLD_BASE @ state.T_base_gripper, 1.0, joint_positions=state.joint_positions
            )
        )
    return observations


@pytest.mark.parametrize("twist", [np.zeros(6), np.array([0, 0, 0, 0.005, 0, 0])], ids=["none", "5 mm"])
def test_depth_images_notice_a_knock_without_a_board(twist):
    observations, knocked = seen_by_cell(moved(twist)), bool(np.any(twist))
    views, said = check_views(observations[:1])
    assert [p.kind for p in said] == ["views_disagree"] * knocked
    assert set(views) == {"left", "right"}
    robot, said = check_robot(observations, known_arm("panda", T_WORLD_BASE).self_filter.distances)
    assert [p.where for p in said] == ["camera left"] * knocked
    assert abs(robot["left"].seen - 1000 * np.linalg.norm(twist)) < 1.5
    assert robot["right"].seen < 1.5
