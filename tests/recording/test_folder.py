import json

import numpy as np
import pytest

from imop.errors import CorruptData, InvalidInput
from imop.recording.draft import Draft
from imop.recording.folder import read_folder
from imop.recording.images import write_color
from tests.recording import takes

POSE = {"position": [0.3, 0.0, 1.0], "quaternion": [1, 0, 0, 0]}


def write(folder, camera=None, frames=None, **changes):
    """A folder that somebody wrote: colours as PNG, depth in millimetres as one array of all frames."""
    folder.mkdir(exist_ok=True)
    known = {
        "intrinsics": {"fx": 10, "fy": 10, "cx": 6, "cy": 4},
        "depth_scale": 0.001,
        "T_world_camera": POSE,
    }
    known |= camera or {}
    seen = [takes.frames(number)["front"] for number in range(4)]
    for number, frame in enumerate(seen):
        write_color(folder / f"{number}.png", frame.rgb)
    np.savez(folder / "all.npz", depth=np.stack([np.round(1000 * f.depth) for f in seen]).astype(np.uint16))
    np.save(folder / "zero.npy", np.zeros((8, 12), np.float32))
    lines = [
        {
            "stamp": number / 10,
            "T_world_gripper": POSE,
            "gripper_opening": 1.0,
            "rgb": {"front": f"{number}.png"},
            "depth": {"front": "all.npz:depth"},
            **(frames or {}),
        }
        for number in range(4)
    ]
    content = {
        "format": "imop-recording",
        "version": 1,
        "cameras": {"front": {k: v for k, v in known.items() if v != "leave out"}},
        "frames": lines,
        **changes,
    }
    (folder / "recording.json").write_text(json.dumps(content))
    return folder


def test_folders_that_others_wrote_are_read(tmp_path):
    read = read_folder(write(tmp_path / "a", instructions="lift it"))
    assert read.instructions == ("lift it",) and read.motion.joint_positions is None
    for number in range(4):
        view, frame = read.observation(number).views["front"], takes.frames(number)["front"]
        np.testing.assert_array_equal(view.rgb, frame.rgb)
        np.testing.assert_allclose(view.depth, frame.depth, atol=5.1e-4)


@pytest.mark.parametrize("field", ["intrinsics", "depth_scale", "T_world_camera"])
def test_no_demonstration_without_what_makes_points_of_depth(tmp_path, field):
    draft = Draft(read_folder(write(tmp_path / "a", {field: "leave out"})), (0, 3))
    with pytest.raises(InvalidInput, match=f"cameras.front.{field}: missing"):
        draft.demonstration()


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"camera": {"depth_scale": 1000}}, "cameras.front.depth_scale"),
        ({"camera": {"fov": 60}}, "cameras.front.fov: unknown"),
        ({"camera": {"T_gripper_camera": POSE}}, "one of the two"),
        ({"camera": {"intrinsics": {"fx": 1}}}, "cameras.front.intrinsics"),
        ({"frames": {"T_world_gripper": {"position": [0, 0, 0]}}}, r"frames\[0\].T_world_gripper"),
        ({"frames": {"rgb": {"side": "0.png"}}}, "rgb.side: unknown camera"),
        ({"frames": {"stamp": "now"}}, r"frames\[0\]"),
        ({"cameras": {}}, "cameras: missing"),
        ({"version": 2}, "version"),
    ],
)
def test_wrong_fields_are_named(tmp_path, change, where):
    with pytest.raises((InvalidInput, CorruptData), match=where):
        read_folder(write(tmp_path / "a", **change))


@pytest.mark.parametrize(
    ("frames", "words"),
    [
        ({"depth": {"front": "all.npz:dept"}}, "all.npz:depth"),
        ({"depth": {"front": "0.png"}}, "one channel"),
        ({"depth": {}}, "depth.front: missing"),
        ({"rgb": {"front": "zero.npy"}}, "red, green and blue"),
        ({"rgb": {"front": "9.png"}}, "missing"),
        ({"rgb": {"front": "recording.json"}}, "cannot be read"),
    ],
)
def test_images_that_cannot_be_used_are_named(tmp_path, frames, words):
    recording = read_folder(write(tmp_path / "a", frames=frames))
    with pytest.raises((InvalidInput, CorruptData), match=words):
        recording.observation(1)
