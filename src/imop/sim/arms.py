"""The arms that the simulation has, each with the Panda's hand: what a world and a planner know of one."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Protocol

import numpy as np

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.geometry.self_filter import SelfFilter
from imop.robots import ARMS, arm_name
from imop.robots.panda import (
    FILTER_MARGIN,
    JOINT_LOWER,
    JOINT_UPPER,
    JOINT_VELOCITY,
    PANDA_HOME_Q,
    T_WORLD_BASE,
)
from imop.sim.kinematics import PandaKinematics
from imop.sim.mjcf_filter import mjcf_self_filter
from imop.sim.robot import ARM_JOINTS, FINGER_JOINTS, FINGERS, panda_spec
from imop.types import FloatArray

FASTEST = 1.5
"""No joint is moved faster, radians per second."""


class Kinematics(Protocol):
    """Between joint positions (J,) and the pose of the gripper in the world."""

    def tip_pose(self, q: FloatArray) -> FloatArray:
        """T_world_gripper (4, 4) for joints (J,), radians."""
        ...

    def inverse(
        self, T_world_gripper: FloatArray, q_reference: FloatArray, limit: int | None = None
    ) -> FloatArray:
        """(n, J) configurations with a pose (4, 4), nearest to a reference (J,) first; n = 0 if none."""
        ...

    def follow(self, poses: FloatArray, q_start: FloatArray) -> FloatArray | None:
        """(n, J): the continuous branch through close-by poses (n, 4, 4), or None where it ends."""
        ...


@dataclass(frozen=True, eq=False)
class Arm:
    """One arm with its hand.

    Attributes:
        name: by which it is asked for.
        joints: (J,) names, in the order of the joint positions; actuators are called alike.
        lower, upper: (J,) radians.
        velocity: (J,) fastest, radians per second.
        home: (J,) radians, where an episode begins.
        T_world_base: (4, 4).
        kinematics: with the base there.
        spec: makes an MjSpec of the arm with bodies hand, left_finger and right_finger, their joints, and the
            site tip. The base is at the origin.
    """

    name: str
    joints: tuple[str, ...]
    lower: FloatArray
    upper: FloatArray
    velocity: FloatArray
    home: FloatArray
    T_world_base: FloatArray
    kinematics: Kinematics
    spec: Callable[[], Any]

    def reachable(self, T_world_gripper: FloatArray) -> bool:
        """Whether the gripper can be taken to a pose (4, 4), collisions aside."""
        return len(self.kinematics.inverse(T_world_gripper, self.home, 1)) > 0


PANDA = Arm(
    "panda",
    ARM_JOINTS,
    JOINT_LOWER,
    JOINT_UPPER,
    np.minimum(JOINT_VELOCITY, FASTEST),
    PANDA_HOME_Q,
    T_WORLD_BASE,
    PandaKinematics(),
    panda_spec,
)


def find_arm(name: str) -> Arm:
    """The arm of a name.

    Raises:
        InvalidInput: if there is none.
        MissingExtra: if its model or mink is not installed.
    """
    name = arm_name(name)
    if name not in ARMS:
        raise InvalidInput("robot", name, ", ".join(ARMS))
    return PANDA if name == PANDA.name else _mounted(name)


@cache
def _mounted(name: str) -> Arm:
    from imop.sim.mounted import make_arm

    return make_arm(name)


def self_filter(arm: Arm) -> SelfFilter:
    """The filter that knows the points of an arm, in the world with its base at `arm.T_world_base`."""
    model = arm.spec().compile()
    margin, finger_margin = FILTER_MARGIN[""], FILTER_MARGIN[FINGERS[0]]
    return mjcf_self_filter(model, arm.joints, FINGER_JOINTS, arm.T_world_base, margin, finger_margin)


def placed(arm: Arm, T_world_base: FloatArray) -> Arm:
    """The same arm with its base elsewhere."""
    return replace(
        arm, T_world_base=T_world_base, kinematics=_Moved(arm.kinematics, arm.T_world_base, T_world_base)
    )


class _Moved:
    """Kinematics of an arm whose base was moved."""

    def __init__(self, known: Kinematics, T_world_base: FloatArray, T_new_base: FloatArray):
        self._known = known
        self._T_new_world = T_new_base @ se3.invert(T_world_base)
        self._T_world_new = se3.invert(self._T_new_world)

    def tip_pose(self, q: FloatArray) -> FloatArray:
        return np.asarray(self._T_new_world @ self._known.tip_pose(q))

    def inverse(
        self, T_world_gripper: FloatArray, q_reference: FloatArray, limit: int | None = None
    ) -> FloatArray:
        return self._known.inverse(self._T_world_new @ T_world_gripper, q_reference, limit)

    def follow(self, poses: FloatArray, q_start: FloatArray) -> FloatArray | None:
        return self._known.follow(self._T_world_new @ poses, q_start)
