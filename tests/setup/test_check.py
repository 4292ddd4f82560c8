from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from imop.geometry import se3
from imop.robots.panda import PANDA_HOME_Q, T_WORLD_BASE
from imop.setup.arm import arm_of
from imop.setup.check import check_setup
from imop.setup.setup import CameraSetup, GripperSetup, Part, RobotSetup, Setup, WorkspaceSetup
from imop.sim.cameras import CAMERAS, observe
from imop.sim.kinematics import inverse_kinematics
from imop.sim.world import World, scene_spec

HOME = inverse_kinematics(se3.make(np.diag([-1.0, 1, -1]), (0.25, 0.1, 1.1)), PANDA_HOME_Q)[0]
OPENGL = se3.make(se3.euler(x=np.pi))


def cell(robot=None, workspace=None, **cameras) -> Setup:
    """The simulation as a set-up."""
    known = {
        name: CameraSetup(
            camera.intrinsics(128, 128),
            (128, 128),
            **{"T_gripper_camera" if camera.on_gripper else "T_world_camera": camera.T_mount_camera},
        )
        for name, camera in CAMERAS.items()
    }
    return Setup(
        robot or RobotSetup("panda", HOME, T_WORLD_BASE),
        workspace or WorkspaceSetup((-0.3, -0.5, 0.6), (0.7, 0.5, 1.6), 0.75),
        known | cameras,
    )


@pytest.fixture(scope="module")
def seen():
    world = World(scene_spec())
    world.set_robot(HOME, 1.0)
    return observe(world).stripped()


def only(findings):
    assert len(findings) == 1, [str(f) for f in findings]
    return findings[0]


def test_nothing_is_wrong_with_the_simulation(seen):
    assert check_setup(cell(), seen) == []


def standing(T):
    front = cell().cameras["front"]
    return replace(front, T_world_camera=T(front.T_world_camera))


@pytest.mark.parametrize(
    ("wrong", "where", "words"),
    [
        (cell(front=standing(se3.invert)), "cameras.front.T_world_camera", "inverted"),
        (cell(front=standing(lambda T: T @ OPENGL)), "cameras.front.T_world_camera", "OpenGL"),
        (cell(front=standing(lambda T: se3.make(p=(0, 3, 0)) @ T)), "cameras.front.T_world_camera", "0%"),
        (cell(again=standing(lambda T: T)), "cameras.again", "where front does"),
        (cell(RobotSetup("panda", HOME + 4 * np.eye(7)[1], T_WORLD_BASE)), "robot.home", "joint 2"),
        (cell(RobotSetup("panda", HOME[:6], T_WORLD_BASE)), "robot.home", "7"),
        (cell(RobotSetup("panda", HOME, se3.make(p=(5, 0, 0)))), "workspace", "T_world_base inverted"),
        (cell(workspace=WorkspaceSetup((-4, -4, 0), (4, 4, 3), 0.75)), "workspace", "edges"),
    ],
)
def test_what_is_wrong_is_named(wrong, where, words):
    found = [f for f in check_setup(wrong) if f.where == where]
    assert any(words in str(f) for f in found), [str(f) for f in check_setup(wrong)]


def test_a_camera_that_looks_away_from_the_fingers_is_told():
    wrist = cell().cameras["wrist"]
    assert wrist.T_gripper_camera is not None
    turned = replace(wrist, T_gripper_camera=wrist.T_gripper_camera @ OPENGL)
    far = replace(wrist, T_gripper_camera=se3.make(p=(0, 0, -1.5)) @ wrist.T_gripper_camera)
    assert "against the direction" in only(check_setup(cell(wrist=turned))).problem
    assert "1." in only(check_setup(cell(wrist=far))).problem


def test_what_is_seen_tells_of_wrong_bases_and_tables(seen):
    base = cell(RobotSetup("panda", HOME, se3.make(p=(0.05, 0, 0)) @ T_WORLD_BASE))
    assert "50 mm" in only(check_setup(base, seen)).problem
    table = cell(workspace=WorkspaceSetup((-0.3, -0.5, 0.6), (0.7, 0.5, 1.6), 0.72))
    assert only(check_setup(table, seen)).where == "workspace.table_height"
    lacking = cell(extra=replace(cell().cameras["front"], T_world_camera=np.eye(4)))
    assert any("no extra" in f.problem for f in check_setup(lacking, seen))


def test_a_model_that_is_not_there_is_one_error():
    gripper = GripperSetup(0.08, (0, 0, 0.1), flange="tool")
    robot = RobotSetup("no.xml", np.zeros(2), T_WORLD_BASE, ("a", "b"))
    found = only(check_setup(replace(cell(), robot=robot, gripper=gripper)))
    assert found.severity == "error" and "no.xml" in found.where


URDF = """
<robot name="pole"><link name="base"/>
  <link name="rod"><visual><origin xyz="0.2 0 0"/><geometry><box size="0.4 0.04 0.04"/></geometry></visual>
    <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="tool"/>
  <joint name="turn" type="revolute"><parent link="base"/><child link="rod"/><origin xyz="0 0 0.1"/>
    <axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <joint name="fixed" type="fixed"><parent link="rod"/><child link="tool"/><origin xyz="0.4 0 0"/></joint>
</robot>
"""


def test_an_arm_from_a_urdf_is_known_by_its_flange(tmp_path: Path):
    pytest.importorskip("mink", reason="the extra arms is not installed")
    (tmp_path / "pole.urdf").write_text(URDF)
    base = se3.make(se3.euler(z=0.5), (0.2, 0.1, 0.75))
    robot = RobotSetup(str(tmp_path / "pole.urdf"), np.zeros(1), base, ("turn",))
    gripper = GripperSetup(0.08, (0.1, 0, 0), (1, 0, 0), (0, 1, 0), "tool")
    part = Part((0.05, 0.05, 0.05), se3.make(p=(0, 0, 0.1)))
    setup = replace(cell(), robot=robot, gripper=gripper, parts={"box": part})
    arm = arm_of(setup)
    T = arm.tip_pose(np.array([0.7]))
    end = np.array([(0.5 * np.cos(0.7), 0.5 * np.sin(0.7), 0.1)])
    np.testing.assert_allclose(T[:3, 3], se3.apply(base, end)[0])
    np.testing.assert_allclose(T[:3, 2], base[:3, :3] @ (np.cos(0.7), np.sin(0.7), 0), atol=1e-9)
    on_rod = se3.apply(base, np.array([(0.2 * np.cos(0.7), 0.2 * np.sin(0.7), 0.115)]))
    points = np.concatenate([on_rod, se3.apply(T, np.array([(0, 0, 0.12), (0.2, 0, 0)]))])
    perception = arm.perception(setup)
    assert perception.robot_mask is not None
    assert perception.robot_mask(points, np.array([0.7]), 1.0).tolist() == [True, True, False]
    assert arm.reachable is not None and arm.reachable(T)
    assert not arm.reachable(se3.make(p=(0, 0, 0.3)) @ T)
    assert perception.lower == (-0.3, -0.5, 0.6)
