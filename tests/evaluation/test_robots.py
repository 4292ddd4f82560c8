import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.evaluation.methods import make_policy
from imop.evaluation.robots import perception_for, robot_functions
from imop.evaluation.trials import Trial
from imop.geometry import se3
from imop.robots.panda import PANDA_HOME_Q, T_WORLD_BASE, panda_self_filter
from imop.setup.file import save_setup
from imop.setup.setup import CameraSetup, RobotSetup, Setup, WorkspaceSetup

ARM = """
import numpy as np

class Pole:
    '''A vertical pole at its base; it reaches half a metre.'''

    def is_robot(self, p_base, joint_positions, gripper_opening):
        return np.linalg.norm(p_base[:, :2], axis=1) < 0.1

    def reachable(self, T_base_gripper):
        return bool(np.linalg.norm(T_base_gripper[:3, 3]) < 0.5)

class Chair:
    pass

def needs(something):
    return Pole()
"""


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    (tmp_path / "arm_of_mine.py").write_text(ARM)
    monkeypatch.syspath_prepend(str(tmp_path))


def test_a_robot_of_ones_own_is_asked_in_the_frame_of_its_base(rng):
    is_robot, reachable = robot_functions("arm_of_mine:Pole")
    p_base = rng.uniform(-0.3, 0.3, (200, 3))
    p_world = se3.apply(T_WORLD_BASE, p_base)
    wanted = np.linalg.norm(p_base[:, :2], axis=1) < 0.1
    np.testing.assert_array_equal(is_robot(p_world, PANDA_HOME_Q, 1.0), wanted)
    for distance, reached in ((0.49, True), (0.51, False)):
        assert reachable(T_WORLD_BASE @ se3.make(p=(distance, 0, 0))) == reached


def test_the_panda_is_the_robot_by_default(rng):
    points = rng.uniform((-0.5, -0.5, 0.7), (0.5, 0.5, 1.6), (2000, 3))
    mask = robot_functions()[0](points, PANDA_HOME_Q, 1.0)
    np.testing.assert_array_equal(mask, panda_self_filter().is_robot(points, PANDA_HOME_Q, 1.0))
    assert mask.any()


@pytest.mark.parametrize("name", ["arm_of_mine:Chair", "arm_of_mine:needs", "arm_of_mine:np", "nobody"])
def test_what_is_no_robot_is_refused(name):
    with pytest.raises(InvalidInput, match="is_robot and reachable"):
        make_policy("registration", robot=name)


def test_a_set_up_says_where_the_workspace_and_the_robot_are(tmp_path):
    away = se3.make(se3.euler(z=0.4), (0.2, 0.3, -0.75))
    setup = Setup(
        RobotSetup("panda", PANDA_HOME_Q, away @ T_WORLD_BASE),
        WorkspaceSetup((-1, -1, -0.2), (1, 1.2, 1), 0.0),
        {"front": CameraSetup([[50, 0, 32], [0, 50, 24], [0, 0, 1]], (64, 48), np.eye(4))},
    )
    save_setup(setup, tmp_path / "cell.toml")
    perception, reachable = perception_for(str(tmp_path / "cell.toml"))
    assert perception.lower == (-1, -1, -0.2) and perception.upper == (1, 1.2, 1)
    here, here_reached = robot_functions()
    points = np.random.default_rng(1).uniform((-0.4, -0.3, 0.7), (0.6, 0.3, 1.7), (5000, 3))
    there = perception.robot_mask(se3.apply(away, points), PANDA_HOME_Q, 1.0)
    assert np.mean(there == here(points, PANDA_HOME_Q, 1.0)) > 0.999 and there.any()
    for x in (0.3, 1.5):
        T = se3.make(np.diag([-1.0, 1, -1]), (x, 0, 1.0))
        assert reachable(away @ T) == here_reached(T)


def test_the_iiwa_is_the_iiwa_14_everywhere():
    home = np.zeros(7)
    assert Trial("tabletop/open_drawer", 1, robot="iiwa") == Trial("tabletop/open_drawer", 1, robot="iiwa14")
    assert RobotSetup("iiwa", home).model == "iiwa14" and RobotSetup("iiwa", home).known
