import pickle
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from imop.errors import CorruptData, InvalidInput
from imop.geometry import se3
from imop.setup.check import check_setup
from imop.setup.file import from_dict, load_setup, save_setup, to_dict
from imop.setup.setup import Setup

TEXT = """
[robot]
model = "arm.xml"
joints = ["a", "b", "c"]
home = [0.1, -0.5, 1.2]
T_world_base = {position = [0.1, 0.2, 0.0], quaternion = [0, 0, 0.6, 0.8]}

[gripper]
stroke = 0.085
tip = [0, 0, 0.15]
closing = [1, 0, 0]
flange = "tool0"
fingers = {left = [0.0, 0.04], right = [0.0, -0.04]}

[workspace]
lower = [0.2, -0.4, -0.05]
upper = [0.8, 0.4, 0.5]
table_height = 0.0

[limits]
speed = 0.1

[cameras.front]
size = [640, 480]
intrinsics = {fx = 600, fy = 601, cx = 319.5, cy = 239.5}
T_world_camera = {position = [1.2, 0, 0.6], quaternion = [0.6, 0.6, -0.3741657386773941, -0.3741657386773941]}
seen_as = "Vorn \\"links\\""

[cameras."am Arm"]
size = [640, 480]
intrinsics = [[600, 0, 320], [0, 600, 240], [0, 0, 1]]
T_gripper_camera = [[1, 0, 0, 0.05], [0, 1, 0, 0], [0, 0, 1, -0.1], [0, 0, 0, 1]]

[parts.camera]
size = [0.1, 0.03, 0.03]
T_gripper_part = {position = [0.05, 0, -0.1], quaternion = [0, 0, 0, 1]}
"""


def write(folder: Path, text: str = TEXT) -> Path:
    path = folder / "cell.toml"
    path.write_text(text)
    return path


def same(a: Setup, b: Setup) -> bool:
    def flat(value):
        if isinstance(value, dict):
            return {k: flat(v) for k, v in value.items()}
        return value if isinstance(value, str) else pytest.approx(value, abs=1e-12)

    return to_dict(a) == flat(to_dict(b))


@pytest.mark.parametrize("ending", ["toml", "json"])
def test_what_is_written_is_read_again(tmp_path, ending):
    setup = load_setup(write(tmp_path))
    save_setup(setup, tmp_path / f"again.{ending}")
    again = load_setup(tmp_path / f"again.{ending}")
    assert same(setup, again)
    assert set(again.cameras) == {"front", "am Arm"} and again.cameras["front"].seen_as == 'Vorn "links"'


@given(st.lists(st.floats(-3, 3), min_size=7, max_size=7))
def test_poses_survive_being_written(numbers):
    T = se3.make(se3.euler(*numbers[:3]), numbers[3:6])
    fields = to_dict(from_dict(plain()))
    fields["robot"]["T_world_base"] = {
        "position": se3.to_pose7(T)[:3].tolist(),
        "quaternion": se3.to_pose7(T)[3:].tolist(),
    }
    again = from_dict(to_dict(from_dict(fields)))
    np.testing.assert_allclose(again.robot.T_world_base, T, atol=1e-9)


def test_the_model_lies_beside_the_file(tmp_path):
    assert load_setup(write(tmp_path)).robot.model == str(tmp_path / "arm.xml")


def test_it_can_be_handed_to_another_process(tmp_path):
    setup = load_setup(write(tmp_path))
    assert same(pickle.loads(pickle.dumps(setup)), setup)


def plain() -> dict:
    return {
        "robot": {"model": "panda", "home": [0, 0.2, 0, -0.9, 0, 1.2, 0.8]},
        "workspace": {"lower": [-0.3, -0.5, 0.6], "upper": [0.7, 0.5, 1.6], "table_height": 0.75},
        "cameras": {"front": {"size": [64, 48], "intrinsics": K, "T_world_camera": POSE}},
    }


K = {"fx": 60, "fy": 60, "cx": 32, "cy": 24}
POSE = {"position": [0, 0, 1], "quaternion": [0, 0, 0, 1]}
MIRRORED = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]]


@pytest.mark.parametrize(
    ("where", "value", "field", "problem"),
    [
        ("robot.modell", "x", "robot.modell", "unknown"),
        ("robott", {}, "robott", "unknown"),
        ("robot.home", None, "robot.home", "missing"),
        ("robot.home", [0, 10, 0, -50, 0, 70, 45], "robot.home", "radians"),
        ("robot.home", "up", "robot.home", "up"),
        ("robot.T_world_base", MIRRORED, "robot.T_world_base", "right-handed"),
        ("robot.T_world_base", {"position": [0, 0, 0]}, "robot.T_world_base", "quaternion"),
        ("robot.T_world_base", {**POSE, "frame": "map"}, "robot.T_world_base.frame", "unknown"),
        ("robot.T_world_base", {**POSE, "quaternion": [0, 0, 1]}, "robot.T_world_base.quaternion", "shape"),
        ("robot.joints", ["a"], "robot.joints", "knows"),
        ("gripper", {"stroke": 0.08, "tip": [0, 0, 0.1]}, "gripper", "panda"),
        ("workspace.lower", [0.8, -0.5, 0.6], "workspace.lower", "below upper.*in x"),
        ("workspace.lower", [-300, -500, 600], "workspace.lower", "millimetres"),
        ("workspace.table_height", 0.0, "workspace.table_height", "0.6"),
        ("limits.speed", 250, "limits.speed", "metres per second"),
        ("limits.speeed", 0.1, "limits.speeed", "speed, turn"),
        ("cameras", {}, "cameras", "at least one"),
        ("cameras.front.size", [48, 64.5], "cameras.front.size", "integers"),
        ("cameras.front.size", [24, 48], "cameras.front.intrinsics", "width, height"),
        ("cameras.front.intrinsics.fx", None, "cameras.front.intrinsics", "fx"),
        ("cameras.front.intrinsics.fx", -1, "cameras.front.intrinsics", "fx, fy > 0"),
        ("cameras.front.intrinsics.skew", 0, "cameras.front.intrinsics.skew", "unknown"),
        ("cameras.front.T_world_camera", None, "cameras.front.T_world_camera", "missing"),
        ("cameras.front.T_gripper_camera", POSE, "cameras.front.T_world_camera", " and "),
        ("parts.box", {"size": [0.1, 0, 0.1], "T_gripper_part": POSE}, "parts.box.size", "above 0"),
    ],
)
def test_what_is_wrong_is_named_as_it_stands_in_the_file(where, value, field, problem):
    fields = plain()
    *path, last = where.split(".")
    table = fields
    for name in path:
        table[name] = dict(table.get(name, {}))
        table = table[name]
    table.pop(last, None)
    if value is not None:
        table[last] = value
    with pytest.raises(InvalidInput, match=problem) as raised:
        from_dict(fields)
    assert raised.value.field == field


def test_what_is_no_such_file_is_said(tmp_path):
    with pytest.raises(CorruptData, match="missing"):
        load_setup(tmp_path / "no.toml")
    with pytest.raises(CorruptData, match="cannot be read"):
        load_setup(write(tmp_path, "robot = ["))
    with pytest.raises(InvalidInput, match=r"\.toml or \.json"):
        save_setup(from_dict(plain()), tmp_path / "cell.yaml")


def test_the_page_about_the_set_up_shows_one_without_faults(tmp_path):
    page = (Path(__file__).parents[2] / "docs" / "real_robot" / "setup.md").read_text()
    first, second = re.findall(r"```toml\n(.*?)```", page, flags=re.DOTALL)
    setup = load_setup(write(tmp_path, first))
    assert [str(f) for f in check_setup(setup)] == []
    other = first[first.index("[workspace]") :]
    assert load_setup(write(tmp_path, second + other)).gripper is not None
