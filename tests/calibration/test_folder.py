import json

import numpy as np
import pytest

from imop.calibration.board import Board
from imop.calibration.folder import DEPTH_STEP, NAME, Recording, read_recording
from imop.calibration.series import RigCamera
from imop.cameras.interfaces import Frame
from imop.errors import CorruptData, ImopError, InvalidInput
from imop.geometry import se3
from imop.robots.interfaces import RobotState

K = np.array([[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]])


@pytest.fixture
def recording(tmp_path, rng):
    started = Recording(tmp_path, Board(), "hand", {"front": RigCamera("world", 64, 48, K)})
    for i in range(2):
        rgb = rng.integers(0, 256, (48, 64, 3), dtype=np.uint8)
        depth = rng.uniform(0.3, 2.0, (48, 64)).astype(np.float32)
        depth[0] = np.nan
        state = RobotState(se3.make(se3.euler(*rng.normal(size=3)), (0.4, 0.1, i)), 0.5, rng.normal(size=7))
        started = started.with_shot(state, {"front": Frame(rgb, depth, K)})
    return started


def changed(recording, change):
    path = recording.folder / NAME
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))


def test_what_was_recorded_is_read_again(recording):
    again = read_recording(recording.folder)
    assert (again.board, again.board_on) == (recording.board, recording.board_on)
    assert again.cameras["front"].mount == "world"
    assert np.allclose(again.cameras["front"].intrinsics, K)
    for i, (shot, other) in enumerate(zip(again.shots, recording.shots, strict=True)):
        assert np.allclose(shot.T_base_gripper, other.T_base_gripper)
        assert np.allclose(shot.joint_positions, other.joint_positions)
        assert np.array_equal(again.rgb(i, "front"), recording.rgb(i, "front"))
        depth = again.depth(i, "front")
        assert not depth[0].any()
        assert np.all(depth[1:] > 0.29) and np.all(depth < 2.0 + DEPTH_STEP)


def test_pictures_without_board_are_no_corners(recording):
    assert all(not shot.corners for shot in recording.series().shots)


def test_poses_may_be_rotation_vectors_or_matrices(recording):
    T = recording.shots[0].T_base_gripper
    vector = {"position": [0, 0, 0.5], "rotation_vector": [np.pi, 0, 0]}
    changed(recording, lambda c: c["shots"][0].update(T_base_gripper=T.tolist()))
    changed(recording, lambda c: c["shots"][1].update(T_base_gripper=vector))
    first, second = read_recording(recording.folder).shots
    assert np.allclose(first.T_base_gripper, T)
    assert np.allclose(second.T_base_gripper, se3.make(se3.euler(x=np.pi), (0, 0, 0.5)))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda c: c["shots"][1].update(joint_positions=[0, 90, 0]),
            r"shots\[1\].joint_positions.*not degrees",
        ),
        (
            lambda c: c["shots"][0].update(
                T_base_gripper={"position": [0, 0, 0], "rotation_vector": [180, 0, 0]}
            ),
            r"shots\[0\].rotation_vector.*not degrees",
        ),
        (
            lambda c: c["shots"][0].update(
                T_base_gripper={"position": [0, 0, 0], "quaternion": [0, 0, 0, 2]}
            ),
            "unit length",
        ),
        (lambda c: c["shots"][0].pop("T_base_gripper"), r"shots\[0\].*T_base_gripper.*missing"),
        (lambda c: c["shots"][0].update(images={"rear": "x.png"}), "camera rear; accepted: one of front"),
        (lambda c: c["cameras"]["front"].update(mount="wall"), "cameras.front.mount"),
        (
            lambda c: c["cameras"]["front"].update(size=[1280, 720]),
            "cameras.front.intrinsics.*this image size",
        ),
        (lambda c: c["board"].update(square=28), "board.square.*metres"),
        (lambda c: c["board"].update(colour="red"), "colour"),
        (lambda c: c.update(format="other"), "imop-calibration-series"),
    ],
)
def test_what_cannot_be_is_named_as_in_the_file(recording, change, words):
    changed(recording, change)
    with pytest.raises(ImopError, match=words):
        read_recording(recording.folder)


def test_pictures_of_another_size_are_refused(recording):
    changed(recording, lambda c: c["cameras"]["front"].update(size=[80, 60], intrinsics=None))
    with pytest.raises(InvalidInput, match="64 x 48 pixels"):
        read_recording(recording.folder).series()


def test_missing_files_are_named(recording):
    (recording.folder / "front" / "0001.png").unlink()
    with pytest.raises(CorruptData, match=r"0001\.png"):
        recording.series()
    (recording.folder / NAME).write_text("{")
    with pytest.raises(CorruptData, match="not JSON"):
        read_recording(recording.folder)
