"""The Panda with its hand as a MuJoCo model, built from published numbers.

Kinematics, limits and shapes are those of `robots/panda.py`; masses and inertias are the identified ones of
Gaz et al. (2019).
"""

import mujoco
import numpy as np

from imop.geometry import se3
from imop.robots.panda import (
    FINGER_STROKE,
    JOINT_LOWER,
    JOINT_TORQUE,
    JOINT_UPPER,
    T_FINGER_OTHER,
    T_FLANGE_HAND,
    T_FLANGE_TIP,
    T_HAND_FINGER,
    T_LINK7_FLANGE,
    T_LINK_JOINT,
)
from imop.robots.panda_shell import SHELLS
from imop.types import FloatArray

ARM_JOINTS = tuple(f"joint{i}" for i in range(1, 8))
FINGER_JOINTS = ("finger_joint1", "finger_joint2")
FINGERS = ("left_finger", "right_finger")

_MASS = {
    "link0": 0.629769,
    "link1": 4.970684,
    "link2": 0.646926,
    "link3": 3.228604,
    "link4": 3.587895,
    "link5": 1.225946,
    "link6": 1.666555,
    "link7": 0.735522,
    "hand": 0.73,
    "left_finger": 0.015,
    "right_finger": 0.015,
}
_CENTRE_OF_MASS = {
    "link0": (-0.041018, -0.00014, 0.049974),
    "link1": (0.003875, 0.002081, -0.04762),
    "link2": (-0.003141, -0.02872, 0.003495),
    "link3": (0.027518, 0.039252, -0.066502),
    "link4": (-0.05317, 0.104419, 0.027454),
    "link5": (-0.011953, 0.041065, -0.038437),
    "link6": (0.060149, -0.014117, -0.010517),
    "link7": (0.010517, -0.004252, 0.061597),
    "hand": (-0.01, 0.0, 0.03),
    "left_finger": (0.0, 0.01, 0.025),
    "right_finger": (0.0, 0.01, 0.025),
}
# About the centre of mass: xx yy zz xy xz yz.
_INERTIA = {
    "link0": (0.00315, 0.00388, 0.004285, 8.2904e-07, 0.00015, 8.2299e-06),
    "link1": (0.70337, 0.70661, 0.009117, -0.000139, 0.006772, 0.019169),
    "link2": (0.007962, 0.02811, 0.025995, -0.003925, 0.010254, 0.000704),
    "link3": (0.037242, 0.036155, 0.01083, -0.004761, -0.011396, -0.012805),
    "link4": (0.025853, 0.019552, 0.028323, 0.007796, -0.001332, 0.008641),
    "link5": (0.035549, 0.029474, 0.008627, -0.002117, -0.004037, 0.000229),
    "link6": (0.001964, 0.004354, 0.005433, 0.000109, -0.001158, 0.000341),
    "link7": (0.012516, 0.010027, 0.004815, -0.000428, -0.001196, -0.000741),
    "hand": (0.001, 0.0025, 0.0017, 0.0, 0.0, 0.0),
    "left_finger": (2.375e-06, 2.375e-06, 7.5e-07, 0.0, 0.0, 0.0),
    "right_finger": (2.375e-06, 2.375e-06, 7.5e-07, 0.0, 0.0, 0.0),
}

_STIFFNESS = np.array([4500.0, 4500.0, 3500.0, 3500.0, 2000.0, 2000.0, 2000.0])
_DAMPING = _STIFFNESS / 10

# A finger that yields to less than these lets go of a thin handle.
_FINGER_STIFFNESS, _FINGER_DAMPING, _FINGER_FORCE = 4000.0, 20.0, 20.0
_FINGER_FRICTION = 80.0  # with the force limit it bounds the speed to RLBench's 0.2 m/s or so

# Shapes that overlap at rest although their bodies are not neighbours in MuJoCo's sense.
_IGNORED_PAIRS = (
    ("link0", "link1"),
    ("link0", "link2"),
    ("link1", "link3"),
    ("link2", "link4"),
    ("link3", "link5"),
    ("link4", "link6"),
    ("link5", "link7"),
    ("left_finger", "right_finger"),
)


def panda_spec() -> mujoco.MjSpec:
    """The robot alone, base at the origin; attach it with prefix "robot/" at `T_WORLD_BASE`.

    Bodies link0 .. link7, hand, left_finger, right_finger; joints and actuators joint1 .. joint7
    (radians) and finger_joint1/2 (metres); site tip. All geoms are in group 0, for rays and collisions
    alike. Attaching does not carry options: the world needs `integrator` implicitfast (the servos are
    stiff) and the elliptic `cone`.
    """
    spec = mujoco.MjSpec()
    spec.modelname = "panda"
    spec.compiler.degree = False
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10
    body = _add_body(spec.worldbody, "link0", np.eye(4))
    for i, name in enumerate(ARM_JOINTS):
        body = _add_body(body, f"link{i + 1}", T_LINK_JOINT[i])
        joint = body.add_joint(
            name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=(0, 0, 1), damping=1, armature=0.1
        )
        limits = (JOINT_LOWER[i], JOINT_UPPER[i])
        joint.range = limits
        _add_actuator(spec, name, _STIFFNESS[i], _DAMPING[i], JOINT_TORQUE[i], limits)
    add_hand(spec, body, T_LINK7_FLANGE @ T_FLANGE_HAND)
    for first, second in _IGNORED_PAIRS:
        spec.add_exclude(bodyname1=first, bodyname2=second)
    return spec


def add_hand(spec: mujoco.MjSpec, parent: mujoco.MjsBody, T_parent_hand: FloatArray) -> None:
    """Mount the Panda's hand on a body: hand, left_finger, right_finger, finger_joint1/2 and the site tip."""
    hand = _add_body(parent, "hand", T_parent_hand)
    _add_tip(hand)
    _add_fingers(spec, hand)


def _add_body(parent: mujoco.MjsBody, name: str, T_parent_body: FloatArray) -> mujoco.MjsBody:
    body = parent.add_body(name=name, pos=T_parent_body[:3, 3], quat=se3.to_wxyz(T_parent_body), gravcomp=1)
    body.mass, body.ipos, body.fullinertia = _MASS[name], _CENTRE_OF_MASS[name], _INERTIA[name]
    body.explicitinertial = True
    for i, shell in enumerate(SHELLS[name]):
        quat = se3.to_wxyz(se3.euler(*shell.rpy))
        geom = body.add_geom(name=f"{name}_{i}", pos=shell.position, quat=quat, rgba=shell.rgba)
        geom.type = getattr(mujoco.mjtGeom, f"mjGEOM_{shell.kind.upper()}")
        geom.size = shell.size
    return body


def _add_tip(hand: mujoco.MjsBody) -> None:
    T_hand_tip = se3.invert(T_FLANGE_HAND) @ T_FLANGE_TIP
    hand.add_site(name="tip", pos=T_hand_tip[:3, 3], quat=se3.to_wxyz(T_hand_tip), group=4)


def _add_fingers(spec: mujoco.MjSpec, hand: mujoco.MjsBody) -> None:
    """finger_joint1 on the hand's +y side, which is the -y side of the tip; the second mirrors the first."""
    places = (T_HAND_FINGER, T_HAND_FINGER @ T_FINGER_OTHER)
    for name, body_name, T in zip(FINGER_JOINTS, FINGERS, places, strict=True):
        finger = _add_body(hand, body_name, T)
        joint = finger.add_joint(
            name=name,
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=(0, 1, 0),
            armature=0.1,
            damping=_FINGER_FRICTION,
        )
        joint.range = (0, FINGER_STROKE)
        for geom in finger.geoms:
            _make_gripping(geom)
        _add_actuator(spec, name, _FINGER_STIFFNESS, _FINGER_DAMPING, _FINGER_FORCE, (0, FINGER_STROKE))
    coupling = spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, name1=FINGER_JOINTS[0], name2=FINGER_JOINTS[1])
    coupling.data[:2] = (0, 1)
    coupling.solref = (0.005, 1)
    coupling.solimp[:3] = (0.95, 0.99, 0.001)


def _make_gripping(geom: mujoco.MjsGeom) -> None:
    """With MuJoCo's default contact a closed finger sinks more than a centimetre into what it holds."""
    geom.solref = (0.004, 1)
    geom.friction = (1.5, 0.02, 0.001)
    geom.condim = 4
    geom.priority = 1


def _add_actuator(
    spec: mujoco.MjSpec,
    joint: str,
    stiffness: float,
    damping: float,
    force: float,
    limits: tuple[float, float],
) -> None:
    actuator = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    actuator.set_to_position(kp=stiffness, kv=damping)
    actuator.ctrlrange = limits
    actuator.forcerange = (-force, force)
