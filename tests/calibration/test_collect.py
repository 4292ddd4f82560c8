from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from imop.calibration.board import Board
from imop.calibration.collect import Rig, collect, proposed_poses, shoot, start_recording
from imop.calibration.folder import read_recording
from imop.cameras.interfaces import Frame
from imop.errors import InvalidInput
from imop.geometry import se3
from imop.robots.interfaces import DONE, MotionResult, RobotState

BOARD = Board()
K = np.array([[400.0, 0.0, 160.0], [0.0, 400.0, 120.0], [0.0, 0.0, 1.0]])


@dataclass
class Arm:
    """Goes where it is told, but for poses above 1 m; creeps by `creep` metres whenever it is asked."""

    T: np.ndarray = field(default_factory=lambda: np.eye(4))
    creep: float = 0.0
    recovered: int = 0
    stopped: bool = False

    def state(self):
        self.T = self.T @ se3.make(p=(self.creep, 0.0, 0.0))
        return RobotState(self.T, 1.0, np.zeros(7))

    def move_to(self, T_base_gripper, *, straight=False, allow_collisions=False):
        if T_base_gripper[2, 3] > 1.0:
            return MotionResult(False, "unreachable", "too high")
        self.T = T_base_gripper
        return DONE

    def move_gripper(self, opening):
        return DONE

    def stop(self):
        self.stopped = True

    def recover(self):
        self.recovered += 1
        return DONE


@dataclass
class Eye:
    """Sees the board, or nothing at all."""

    sees: bool = True

    def capture(self):
        rgb = np.full((240, 320, 3), 255, dtype=np.uint8)
        if self.sees:
            rgb[30:210, 40:280] = BOARD.picture(30)[..., None]
        return Frame(rgb, np.ones((240, 320), dtype=np.float32), K)


def poses(*heights):
    return [se3.make(p=(0.4, 0.0, z)) for z in heights]


def test_pictures_are_stored_with_the_poses_where_they_were_taken(tmp_path):
    rig = Rig(Arm(), {"front": Eye()})
    recording = start_recording(tmp_path, rig, BOARD, "hand")
    done = collect(recording, rig, poses(0.1, 0.2, 0.3), 15)
    stored = read_recording(tmp_path)
    assert [shot.T_base_gripper[2, 3] for shot in stored.shots] == pytest.approx([0.1, 0.2, 0.3])
    assert len(done.shots) == 3
    assert all(len(shot.corners["front"].ids) == 35 for shot in stored.series().shots)


def test_poses_that_cannot_be_reached_are_left_out_and_said(tmp_path):
    rig, said = Rig(Arm(), {"front": Eye()}), []
    recording = start_recording(tmp_path, rig, BOARD, "hand")
    done = collect(recording, rig, poses(0.1, 1.2, 0.3), 15, lambda *what: said.append(what))
    assert len(done.shots) == 2 and rig.robot.recovered == 1
    assert said[1] == (1, "not reached", "unreachable too high")


def test_it_ends_with_enough_pictures_and_is_continued(tmp_path):
    rig = Rig(Arm(), {"front": Eye()})
    collect(start_recording(tmp_path, rig, BOARD, "hand"), rig, poses(0.1, 0.2, 0.3), 2)
    again = start_recording(tmp_path, rig, BOARD, "hand")
    assert len(again.shots) == 2
    assert len(collect(again, rig, poses(0.4, 0.5, 0.6), 4).shots) == 4
    with pytest.raises(InvalidInput, match="new folder"):
        start_recording(tmp_path, rig, BOARD, "table")


def test_nothing_is_stored_of_an_arm_that_moves_or_without_the_board(tmp_path):
    rig = Rig(Arm(creep=0.002), {"front": Eye()})
    recording = start_recording(tmp_path, rig, BOARD, "hand")
    assert shoot(recording, rig) == (recording, "moved")
    blind = replace(rig, robot=Arm(), cameras={"front": Eye(sees=False)})
    assert shoot(recording, blind) == (recording, "no board")


def test_whatever_interrupts_it_stops_the_arm(tmp_path):
    rig = Rig(Arm(), {"front": Eye()})
    recording = start_recording(tmp_path, rig, BOARD, "hand")

    def interrupt(*what):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        collect(recording, rig, poses(0.1, 0.2), 15, interrupt)
    assert rig.robot.stopped


def test_cameras_that_move_with_the_board_are_left_out(tmp_path):
    rig = Rig(Arm(), {"front": Eye(), "wrist": Eye()}, {"wrist": "hand"})
    assert set(start_recording(tmp_path, rig, BOARD, "hand").cameras) == {"front"}
    with pytest.raises(InvalidInput, match="relative to the board"):
        start_recording(tmp_path, replace(rig, cameras={"wrist": Eye()}), BOARD, "hand")


def test_proposed_poses_turn_about_the_point_that_is_looked_at(rng):
    T, ahead = se3.make(se3.euler(x=np.pi), (0.4, 0.0, 0.5)), 0.4
    proposed = np.stack(proposed_poses(T, rng, 50, ahead))
    seen = proposed @ (0, 0, ahead, 1)
    assert np.abs(seen[:, :3] - (0.4, 0.0, 0.1)).max() < 0.081
    assert np.degrees(se3.rotation_distance(proposed, T)).min() > 5
