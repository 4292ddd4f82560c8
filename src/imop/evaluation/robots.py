"""What a policy needs to know of a robot: its own points, and which poses it reaches."""

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Protocol, cast

from imop import plugins
from imop.errors import InvalidInput, MissingExtra
from imop.geometry import se3
from imop.geometry.perception import Perception, RobotMask
from imop.robots import ARMS, arm_name
from imop.robots.panda import T_WORLD_BASE, panda_self_filter
from imop.setup.arm import arm_of
from imop.setup.file import load_setup
from imop.types import BoolArray, FloatArray

PANDA, *SIMULATED = ARMS
_OWN = (
    "a class or function that makes, called without arguments, an object with is_robot and reachable, named "
    "module:object or by an entry point imop.robots"
)

Reachable = Callable[[FloatArray], bool]


class RobotModel(Protocol):
    """What a robot of one's own looks like and reaches, in the frame of its base; nothing of it moves."""

    def is_robot(self, p_base: FloatArray, joint_positions: FloatArray, gripper_opening: float) -> BoolArray:
        """(N,) which points (N, 3) are the robot's; joint positions as recorded, opening 0 .. 1."""

    def reachable(self, T_base_gripper: FloatArray) -> bool:
        """Whether the gripper can be taken to a pose (4, 4)."""


def perception_for(name: str = PANDA) -> tuple[Perception, Reachable | None]:
    """What makes clouds without a robot, and which poses it reaches.

    Args:
        name: the path of a set-up (.toml or .json), whose world and workspace then count, or a name as of
            `robot_functions`.

    Raises:
        InvalidInput, CorruptData, MissingExtra: as `load_setup`, `arm_of` and `robot_functions`.
    """
    if name.endswith((".toml", ".json")):
        setup = load_setup(Path(name))
        arm = arm_of(setup)
        return arm.perception(setup), arm.reachable
    is_robot, reachable = robot_functions(name)
    return Perception(is_robot), reachable


def robot_functions(name: str = PANDA) -> tuple[RobotMask, Reachable | None]:
    """The self-filter and the reachability of a robot, in imop's world frame.

    Args:
        name: panda, one of `SIMULATED`, "module:object", or an entry point of the group imop.robots.

    Returns:
        Reachability is None for the Panda without the extra sim: then no pose is ruled out.

    Raises:
        InvalidInput: if there is no such robot, or it is none.
        MissingExtra: if the model of one of `SIMULATED` is not installed.
    """
    name = arm_name(name)
    if name == PANDA:
        return panda_self_filter().is_robot, _panda_reachable()
    if name in SIMULATED:
        return _simulated(name)
    robot, T_base_world = _own(name), se3.invert(T_WORLD_BASE)

    def is_robot(p_world: FloatArray, joint_positions: FloatArray, gripper_opening: float) -> BoolArray:
        return robot.is_robot(se3.apply(T_base_world, p_world), joint_positions, gripper_opening)

    return is_robot, lambda T_world_gripper: robot.reachable(T_base_world @ T_world_gripper)


def _own(name: str) -> RobotModel:
    factory = plugins.find("robot", name, "imop.robots")
    if not (inspect.isclass(factory) or inspect.isfunction(factory)) or not plugins.takes_nothing(factory):
        raise InvalidInput(
            "robot", name, f"{PANDA}, {', '.join(SIMULATED)}, a set-up (.toml or .json), or {_OWN}"
        )
    robot = factory()
    if not all(callable(getattr(robot, part, None)) for part in ("is_robot", "reachable")):
        raise InvalidInput("robot", f"{name} makes a {type(robot).__name__}", _OWN)
    return cast(RobotModel, robot)


def _simulated(name: str) -> tuple[RobotMask, Reachable]:
    from imop.sim.arms import find_arm, self_filter

    arm = find_arm(name)
    return self_filter(arm).is_robot, arm.reachable


def _panda_reachable() -> Reachable | None:
    try:
        from imop.sim.kinematics import reachable
    except MissingExtra:
        return None
    return reachable
