import json
from dataclasses import replace

import numpy as np
import pytest

from imop.calibration.calibrate import calibrate
from imop.calibration.result import load_calibration, save_calibration
from imop.errors import CorruptData
from imop.geometry import se3
from imop.setup.file import from_dict

from .rigs import MOUNTS, rig

T_WORLD_BASE = se3.make(se3.euler(z=0.4), (-0.2, 0.1, 0.75))


@pytest.fixture(scope="module", params=MOUNTS)
def found(request):
    _, series = rig(0, request.param, shots=8)
    return calibrate(series, T_WORLD_BASE)


def test_a_calibration_survives_its_file(found, tmp_path):
    save_calibration(found, tmp_path / "calibration.json")
    again = load_calibration(tmp_path / "calibration.json")
    assert (again.board, again.board_on, again.problems) == (found.board, found.board_on, found.problems)
    for name, camera in found.cameras.items():
        assert again.cameras[name].quality == camera.quality
        assert np.allclose(again.cameras[name].T_mount_camera, camera.T_mount_camera)
        assert np.allclose(again.cameras[name].camera.intrinsics, camera.camera.intrinsics)
    assert np.allclose(again.T_place_board, found.T_place_board)
    assert np.allclose(again.T_world_base, T_WORLD_BASE)


def test_its_cameras_are_those_of_a_set_up_file(found, tmp_path):
    save_calibration(found, tmp_path / "calibration.json")
    pose = {"position": T_WORLD_BASE[:3, 3].tolist(), "quaternion": se3.to_pose7(T_WORLD_BASE)[3:].tolist()}
    fields = {
        "robot": {"model": "panda", "home": [0.0] * 7, "T_world_base": pose},
        "workspace": {"lower": [-0.3, -0.5, 0.6], "upper": [0.7, 0.5, 1.6], "table_height": 0.75},
        "cameras": json.loads((tmp_path / "calibration.json").read_text())["cameras"],
    }
    setup = from_dict(fields)
    T_base_gripper = se3.make(se3.euler(x=3.0), (0.4, 0.0, 0.3))
    for name, camera in setup.cameras.items():
        T = found.T_world_camera(name, T_base_gripper)
        assert np.allclose(camera.pose(T_WORLD_BASE @ T_base_gripper), T)


@pytest.mark.parametrize(
    "damage",
    [
        lambda c: c.update(version=2),
        lambda c: c.pop("cameras"),
        lambda c: c["T_place_board"].update(quaternion=[0, 0, 0, 2]),
        lambda c: c.update(quality={}),
    ],
)
def test_damaged_files_say_what_to_do(found, tmp_path, damage):
    path = tmp_path / "calibration.json"
    save_calibration(replace(found), path)
    content = json.loads(path.read_text())
    damage(content)
    path.write_text(json.dumps(content))
    with pytest.raises(CorruptData, match="imop calibrate solve"):
        load_calibration(path)
