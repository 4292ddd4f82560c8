import numpy as np
import pytest

pytest.importorskip("rosbags", reason="the extra import is not installed")

from rosbags.rosbag2 import StoragePlugin

from imop.errors import CorruptData, InvalidInput
from imop.geometry import se3
from imop.importing.ros_images import color_of, depth_of
from imop.importing.rosbag import read_bag
from imop.importing.side import Side, read_side
from imop.importing.sources import find_sources
from imop.recording.draft import Draft
from tests.importing import bags
from tests.recording import takes


def assert_is_the_take(episode, tolerance):
    states = takes.moments()
    assert len(episode.motion) == len(states)
    np.testing.assert_allclose(episode.motion.times, [s.stamp for s in states], atol=1e-6)
    np.testing.assert_allclose(episode.motion.joint_positions, [s.joint_positions for s in states], atol=1e-3)
    np.testing.assert_allclose(episode.motion.gripper_opening, [s.gripper_opening for s in states], atol=1e-3)
    for number in (0, 17, len(states) - 1):
        expected = takes.cell().observation(states[number], takes.frames(number))
        found = episode.observation(number)
        assert list(found.views) == ["front"]
        assert se3.near(found.T_world_gripper, expected.T_world_gripper, 1e-3, 1e-3)
        view, wanted = found.views["front"], expected.views["front"]
        np.testing.assert_array_equal(view.rgb, wanted.rgb)
        np.testing.assert_allclose(view.depth, wanted.depth, atol=tolerance)
        np.testing.assert_allclose(view.intrinsics, wanted.intrinsics)
        np.testing.assert_allclose(view.T_world_camera, wanted.T_world_camera, atol=1e-9)


@pytest.mark.parametrize(
    ("plugin", "depth", "tolerance"),
    [(StoragePlugin.MCAP, "16UC1", 5.1e-4), (StoragePlugin.SQLITE3, "32FC1", 1e-6)],
)
def test_a_bag_tells_everything(tmp_path, plugin, depth, tolerance):
    bag = bags.write(tmp_path / "lift", bags.messages(depth), plugin)
    assert_is_the_take(read_bag(bag, Side()), tolerance)
    (single,) = [file for file in bag.iterdir() if file.suffix in (".mcap", ".db3")]
    assert_is_the_take(read_bag(single, Side()), tolerance)
    (below,) = find_sources("rosbag", tmp_path)
    assert len(Draft.of(below).demonstration()) == 2


@pytest.mark.parametrize(
    ("leave_out", "more", "field"),
    [
        ([bags.DEPTH], {}, "cameras.NAME.depth"),
        ([bags.RGB], {}, "cameras.NAME.rgb"),
        ([bags.INFO], {}, "cameras.front.intrinsics: missing"),
        (["/franka_gripper/joint_states"], {}, "gripper.fingers: missing"),
        (["/joint_states"], {}, "joints"),
        (["/tf_static"], {}, "world"),
        ([], {"tip": "my_tip"}, "gripper.frame: missing"),
        ([], {"distortion": (0.1, 0, 0, 0, 0)}, "cameras.front.intrinsics"),
    ],
)
def test_what_is_missing_is_named(tmp_path, leave_out, more, field):
    bag = bags.write(tmp_path / "bag", bags.messages(**more), leave_out=leave_out)
    with pytest.raises(InvalidInput, match=field):
        read_bag(bag, Side())


def test_a_side_file_says_what_is_missing(tmp_path):
    camera = f"""
joints = {bags.JOINTS}
[gripper]
frame = "my_tip"
fingers = {{panda_finger_joint1 = [0.0, 0.04], panda_finger_joint2 = [0.0, 0.04]}}
[cameras.front]
rgb = "{bags.RGB}"
depth = "{bags.DEPTH}"
intrinsics = {takes.K.tolist()}
"""
    (tmp_path / "side.toml").write_text(camera)
    bag = bags.write(tmp_path / "bag", bags.messages(tip="my_tip"), leave_out=[bags.INFO])
    assert_is_the_take(read_bag(bag, read_side(tmp_path / "side.toml")), 5.1e-4)
    (tmp_path / "side.toml").write_text(camera.replace("my_tip", "your_tip"))
    with pytest.raises(InvalidInput, match=r"gripper\.frame.*your_tip.*my_tip"):
        read_bag(bag, read_side(tmp_path / "side.toml"))
    (tmp_path / "side.toml").write_text(camera.replace(bags.DEPTH, "/front/depth"))
    with pytest.raises(InvalidInput, match=r"cameras\.front\.depth.*aligned"):
        read_bag(bag, read_side(tmp_path / "side.toml"))


def test_a_camera_on_the_hand_moves_with_it(tmp_path):
    T_hand_optical = bags.T_HAND_TIP @ takes.T_GRIPPER_WRIST
    moved = [m for m in bags.messages() if "front_link" not in str(m[2])]
    moved.append(("/tf_static", 99.0, bags.transform("panda_hand", "front_optical", 99.0, T_hand_optical)))
    episode = read_bag(bags.write(tmp_path / "bag", moved), Side())
    for number in (0, 30):
        expected = episode.motion.T_world_gripper[number] @ takes.T_GRIPPER_WRIST
        found = episode.observation(number).views["front"].T_world_camera
        np.testing.assert_allclose(found, expected, atol=1e-9)


def test_clocks_that_differ_are_said(tmp_path):
    late = [m for m in bags.messages() if m[0] not in (bags.RGB, bags.DEPTH)]
    frame = takes.frames(0)["front"]
    for stamp in (500.0, 500.1):
        late.append((bags.RGB, stamp, bags.image(stamp, frame.rgb, "rgb8")))
        late.append((bags.DEPTH, stamp, bags.image(stamp, frame.depth, "32FC1")))
    with pytest.raises(InvalidInput, match="clock"):
        read_bag(bags.write(tmp_path / "bag", late), Side())


def test_what_is_no_bag_is_said(tmp_path):
    (tmp_path / "a.mcap").write_bytes(b"nothing")
    with pytest.raises(CorruptData, match="bag"):
        read_bag(tmp_path / "a.mcap", Side())
    with pytest.raises(InvalidInput, match="no episode"):
        find_sources("rosbag", tmp_path / "nowhere")


def test_damaged_bags_end_in_clear_errors(tmp_path, rng):
    bag = bags.write(tmp_path / "bag", bags.messages())
    (file,) = bag.glob("*.mcap")
    whole = file.read_bytes()
    for k in range(12):
        damaged = bytearray(whole)
        if k % 2:
            damaged = damaged[: int(rng.integers(len(whole)))]
        for place in rng.integers(0, max(len(damaged), 1), 20) if not k % 2 else ():
            damaged[place] = int(rng.integers(256))
        file.write_bytes(bytes(damaged))
        try:
            read_bag(bag, Side()).observation(3)
        except (CorruptData, InvalidInput):
            continue


def test_compressed_images_are_read():
    import io

    from PIL import Image

    frame = takes.frames(3)["front"]
    steps = np.round(1000 * frame.depth).astype(np.uint16)
    for pixels, told, head, read, expected in (
        (frame.rgb, "bgr8; png compressed bgr8", b"", color_of, frame.rgb),
        (steps, "16UC1; compressedDepth png", bytes(12), depth_of, steps),
    ):
        buffer = io.BytesIO()
        Image.fromarray(pixels).save(buffer, format="PNG")
        data = np.frombuffer(head + buffer.getvalue(), np.uint8)
        message = bags.kind("sensor_msgs/msg/CompressedImage")(bags.header(1.0), told, data)
        np.testing.assert_array_equal(read(message, "here"), expected)
        with pytest.raises(CorruptData, match="here"):
            read(bags.kind("sensor_msgs/msg/CompressedImage")(bags.header(1.0), told, data[:40]), "here")
