"""The Panda with its hand: published kinematics and limits, and which points of a scene are its own.

The hand sits as in RLBench: the fingers are centred at the tip, the hand body is 2 mm beside it.
"""

import numpy as np

from imop.geometry import primitives, se3
from imop.geometry.self_filter import Distance, SelfFilter, Solid
from imop.robots.panda_shell import SHELLS, Shell
from imop.types import FloatArray, as_array, as_pose

FINGER_STROKE = 0.04
"""How far each finger moves, metres."""

JOINT_LOWER = np.array([-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973])
JOINT_UPPER = np.array([2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973])
JOINT_VELOCITY = np.array([2.1750, 2.1750, 2.1750, 2.1750, 2.6100, 2.6100, 2.6100])
JOINT_ACCELERATION = np.array([15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0])
JOINT_TORQUE = np.array([87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0])

RLBENCH_JOINT4_OFFSET = 0.0698
"""Added to RLBench's joint 4 it gives Franka's, radians."""

PANDA_HOME_Q = np.radians([0.0, 10.0, 0.0, -50.0, 0.0, 70.0, 45.0]) + RLBENCH_JOINT4_OFFSET * np.eye(7)[3]
"""Start configuration of RLBench in Franka's convention."""

T_WORLD_BASE = se3.make(p=(-0.2680, -0.0064, 0.7500))
T_FLANGE_HAND = se3.make(se3.euler(z=-np.pi / 4), (0.0014, 0.0014, -0.0023))
"""RLBench's hand sits 2 mm beside and 2.3 mm behind Franka's; relative to it the fingers are Franka's."""
T_FLANGE_TIP = se3.make(se3.euler(z=3 * np.pi / 4), (0.0014, 0.0014, 0.1099))
"""To RLBench's tip: between the finger ends, +z the approach direction, +y the closing direction."""
T_LINK7_FLANGE = se3.make(p=(0, 0, 0.107))
T_HAND_FINGER = se3.make(p=(0, 0, 0.0584))
"""To the finger on the hand's +y side, closed; the other is turned by 180 degrees about z."""
T_FINGER_OTHER = se3.make(se3.euler(z=np.pi))

# Modified Denavit-Hartenberg: x rotation and x translation before the joint, z translation with it.
_ALPHA = (0.0, -np.pi / 2, np.pi / 2, np.pi / 2, -np.pi / 2, np.pi / 2, np.pi / 2)
_A = (0.0, 0.0, 0.0, 0.0825, -0.0825, 0.0, 0.088)
_D = (0.333, 0.0, 0.316, 0.0, 0.384, 0.0, 0.0)
T_LINK_JOINT = np.stack(
    [
        se3.make(se3.euler(x=alpha), (a, 0, 0)) @ se3.make(p=(0, 0, d))
        for alpha, a, d in zip(_ALPHA, _A, _D, strict=True)
    ]
)
"""(7, 4, 4) from each link's frame to that of the next one with its joint at zero."""

# Around the fingers is what they hold; the lower links, several millimetres off in RLBench, touch nothing.
FILTER_MARGIN = {
    "": 0.008,
    "link0": 0.015,
    "link1": 0.012,
    "link2": 0.012,
    "left_finger": 0.0012,
    "right_finger": 0.0012,
}
"""How far beyond a body's surface the filter removes points, metres; "" is all other bodies."""

_DISTANCE: dict[str, Distance] = {
    "capsule": primitives.capsule,
    "cylinder": primitives.cylinder,
    "box": primitives.box,
    "ellipsoid": primitives.ellipsoid,
}


def link_poses(q: FloatArray) -> FloatArray:
    """Poses (8, 4, 4) of the seven link frames and the flange in the world, for joints `q` (7,) radians.

    Raises:
        InvalidInput: if `q` does not have seven entries.
    """
    q = as_array("q", q, (7,))
    c, s = np.cos(q)[:, None], np.sin(q)[:, None]
    x, y = T_LINK_JOINT[:, :3, 0], T_LINK_JOINT[:, :3, 1]
    turned = T_LINK_JOINT.copy()
    turned[:, :3, 0], turned[:, :3, 1] = c * x + s * y, c * y - s * x
    poses = np.empty((8, 4, 4))
    T = T_WORLD_BASE
    for i, T_link in enumerate(turned):
        poses[i] = T = T @ T_link
    poses[7] = T @ T_LINK7_FLANGE
    return poses


def tip_pose(q: FloatArray) -> FloatArray:
    """T_world_gripper (4, 4) for joints `q` (7,), radians in Franka's convention.

    Raises:
        InvalidInput: if `q` does not have seven entries.
    """
    T: FloatArray = link_poses(q)[-1] @ T_FLANGE_TIP
    return T


def body_poses(q: FloatArray, opening: float) -> FloatArray:
    """Poses (11, 4, 4) in the world of link0 .. link7, hand, left and right finger, as `SHELLS` has them.

    Args:
        q: (7,) radians.
        opening: 0 closed .. 1 open.
    """
    links = link_poses(q)
    T_world_hand = links[-1] @ T_FLANGE_HAND
    T_slide = se3.make(p=(0, opening * FINGER_STROKE, 0))
    left = T_world_hand @ T_HAND_FINGER @ T_slide
    right = T_world_hand @ T_HAND_FINGER @ T_FINGER_OTHER @ T_slide
    return np.concatenate([T_WORLD_BASE[None], links[:7], np.stack([T_world_hand, left, right])])


def panda_self_filter(T_world_base: FloatArray | None = None) -> SelfFilter:
    """The filter that knows the Panda's points in a scene.

    Args:
        T_world_base: (4, 4), where its base stands; by default as in imop's own scenes and RLBench's,
            `T_WORLD_BASE`. Anywhere else the filter removes nothing, or the wrong points.

    Raises:
        InvalidInput: if it is no rigid transformation.
    """
    bodies = [
        [_solid(shell, FILTER_MARGIN.get(name, FILTER_MARGIN[""])) for shell in shells]
        for name, shells in SHELLS.items()
    ]
    T_body_solid = np.stack(
        [se3.make(se3.euler(*shell.rpy), shell.position) for shells in SHELLS.values() for shell in shells]
    )
    body = np.repeat(np.arange(len(SHELLS)), [len(shells) for shells in SHELLS.values()])
    if T_world_base is None:
        return SelfFilter(7, bodies, lambda q, opening: body_poses(q, opening)[body] @ T_body_solid)
    moved = as_pose("T_world_base", T_world_base) @ se3.invert(T_WORLD_BASE)
    return SelfFilter(7, bodies, lambda q, opening: moved @ body_poses(q, opening)[body] @ T_body_solid)


def _solid(shell: Shell, margin: float) -> Solid:
    first, second, third = shell.size
    radii = {
        "capsule": first + second,
        "cylinder": np.hypot(first, second),
        "box": np.linalg.norm(shell.size),
        "ellipsoid": max(first, second, third),
    }
    return Solid(_DISTANCE[shell.kind], np.array(shell.size), float(radii[shell.kind]), margin)
