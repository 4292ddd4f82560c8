"""The drivers that a set-up names, connected: the arm, guarded, and its cameras."""

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from imop.cameras.interfaces import Camera
from imop.errors import InvalidInput
from imop.geometry import se3
from imop.robots import panda
from imop.robots.guarded import GuardedRobot
from imop.robots.interfaces import Robot
from imop.setup.setup import CAMERA_DRIVERS, ROBOT_DRIVERS, CameraSetup, Setup

if TYPE_CHECKING:
    from imop.sim.gripper import OnFrame
    from imop.sim.world import World

_FAR = 4.5
"""What is farther a simulated camera does not measure, metres."""


@dataclass(frozen=True, eq=False)
class SimulatedScene:
    """What the driver called simulated moves and sees.

    Attributes:
        world: with the arm of the set-up. Where its base stands there does not matter.
        on_frame: called with the world every 0.05 simulated seconds of motion.
    """

    world: "World"
    on_frame: "OnFrame | None" = None


@contextmanager
def connected(
    setup: Setup, scene: SimulatedScene | None = None
) -> Iterator[tuple[GuardedRobot, Mapping[str, Camera]]]:
    """The arm and its cameras, until the context ends; if by an exception, the arm is stopped.

    Args:
        setup: names the drivers.
        scene: of those that are called simulated.

    Raises:
        InvalidInput: if a driver is not named, or cannot be what the set-up says.
        MissingExtra: if a driver's package is not installed.
        ConnectionError: if something does not answer.
    """
    with ExitStack() as stack:
        driver = _robot(setup, scene, stack)
        space = setup.workspace
        robot = GuardedRobot(driver, setup.robot.T_world_base, space.lower, space.upper, setup.limits)
        cameras = {n: _camera(setup, n, c, scene, stack) for n, c in setup.cameras.items()}
        try:
            yield robot, cameras
        except BaseException:
            robot.stop()
            raise


def _robot(setup: Setup, scene: SimulatedScene | None, stack: ExitStack) -> Robot:
    robot, gripper = setup.robot, setup.gripper
    if robot.driver in ("franka", "universal_robots") and not robot.address:
        raise InvalidInput("robot.address", "missing", "the address of the arm's controller")
    match robot.driver:
        case "franka":
            from imop.robots.franka import FrankaRobot

            T = panda.T_FLANGE_TIP if gripper is None else gripper.T_flange_gripper
            return stack.enter_context(closing(FrankaRobot(robot.address, setup.limits, T)))
        case "universal_robots":
            from imop.robots.robotiq import RobotiqGripper
            from imop.robots.universal_robots import UniversalRobot

            if gripper is None:
                accepted = "a file of your arm, and a table [gripper]: imop's has the Panda's hand"
                raise InvalidInput("robot.model", robot.model, accepted)
            fingers, T = RobotiqGripper(robot.address), gripper.T_flange_gripper
            return stack.enter_context(closing(UniversalRobot(robot.address, setup.limits, T, fingers)))
        case "simulated":
            from imop.sim.driver import SimulatedRobot

            found = _in_scene(scene, "robot.driver")
            if found.world.arm.name != robot.model:
                raise InvalidInput("robot.model", robot.model, f"{found.world.arm.name}, as the scene has")
            return SimulatedRobot(found.world, setup.limits, found.on_frame)
        case _:
            raise InvalidInput("robot.driver", robot.driver or "missing", ", ".join(ROBOT_DRIVERS))


def _camera(
    setup: Setup, name: str, camera: CameraSetup, scene: SimulatedScene | None, stack: ExitStack
) -> Camera:
    match camera.driver:
        case "realsense":
            from imop.cameras.realsense import RealSenseCamera

            if not camera.serial:
                raise InvalidInput(f"cameras.{name}.serial", "missing", "the number on the camera")
            return stack.enter_context(closing(RealSenseCamera(camera.serial, camera.size)))
        case "simulated":
            return _simulated_camera(setup, name, camera, _in_scene(scene, f"cameras.{name}.driver"))
        case _:
            given = camera.driver or "missing"
            raise InvalidInput(f"cameras.{name}.driver", given, ", ".join(CAMERA_DRIVERS))


def _simulated_camera(setup: Setup, name: str, camera: CameraSetup, scene: SimulatedScene) -> Camera:
    from imop.sim.cameras import Camera as RayCamera
    from imop.sim.driver import SimulatedCamera

    T_scene_world = scene.world.arm.T_world_base @ se3.invert(setup.robot.T_world_base)
    mounted = camera.T_gripper_camera
    T_mount = T_scene_world @ camera.pose(np.eye(4)) if mounted is None else mounted
    field_of_view = 2 * np.arctan(camera.size[1] / 2 / camera.intrinsics[1, 1])
    ray = RayCamera(T_mount, float(field_of_view), _FAR, camera.on_gripper)
    if np.abs(ray.intrinsics(*camera.size) - camera.intrinsics).max() > 1.0:
        accepted = "fx = fy, and cx, cy in the middle of the image: that is what simulated cameras have"
        raise InvalidInput(f"cameras.{name}.intrinsics", f"{camera.intrinsics.tolist()}", accepted)
    return SimulatedCamera(scene.world, ray, camera.size)


def _in_scene(scene: SimulatedScene | None, field: str) -> SimulatedScene:
    if scene is None:
        raise InvalidInput(field, "simulated, but there is no scene", "a task, whose scene it is")
    return scene
