"""What a set-up's arm looks like and reaches in the world, by imop's own knowledge or a model file."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from imop.errors import CorruptData, InvalidInput, MissingExtra
from imop.geometry import se3
from imop.geometry.perception import Perception
from imop.geometry.self_filter import SelfFilter, TipPose, box
from imop.robots import panda
from imop.setup.setup import Part, Setup
from imop.types import FloatArray

PART_MARGIN = 0.005
"""How far beyond a mounted part the filter removes points, metres."""
_TIP = "imop_tip"


@dataclass(frozen=True, eq=False)
class SetupArm:
    """The arm where the set-up has it.

    Attributes:
        tip_pose: joint positions (J,) -> T_world_gripper (4, 4).
        lower, upper: (J,) limits of the joints, radians.
        self_filter: with the mounted parts.
        reachable: whether the gripper can be taken to T_world_gripper (4, 4); None if that cannot be asked
            for want of the extra sim.
    """

    tip_pose: TipPose
    lower: FloatArray
    upper: FloatArray
    self_filter: SelfFilter
    reachable: Callable[[FloatArray], bool] | None

    def perception(self, setup: Setup, **options: Any) -> Perception:
        """What makes clouds of this set-up's observations; for `options` see `Perception`."""
        return setup.workspace.perception(self.self_filter.is_robot, **options)


def arm_of(setup: Setup) -> SetupArm:
    """The arm of a set-up.

    Raises:
        CorruptData: if the model's file is missing or is none.
        InvalidInput: if the model has no such joint, body or site.
        MissingExtra: for any arm but the Panda without the extra sim, or arms.
    """
    robot = setup.robot
    arm = known_arm(robot.model, robot.T_world_base, robot.home) if robot.known else _file(setup)
    parts = list(setup.parts.values())
    return replace(arm, self_filter=_with_parts(arm.self_filter, parts, arm.tip_pose))


def known_arm(name: str, T_world_base: FloatArray, home: FloatArray | None = None) -> SetupArm:
    """One of `robots.ARMS` with its base at a pose (4, 4); poses are reached from `home` (J,), if given.

    Raises:
        MissingExtra: for any arm but the Panda without the extra sim, or arms.
    """
    return _panda(T_world_base) if name == "panda" else _simulated(name, T_world_base, home)


def _with_parts(self_filter: SelfFilter, parts: list[Part], tip_pose: TipPose) -> SelfFilter:
    if not parts:
        return self_filter
    solids = [box(part.size, PART_MARGIN) for part in parts]
    return self_filter.with_mounted(solids, np.stack([p.T_gripper_part for p in parts]), tip_pose)


def _panda(T_world_base: FloatArray) -> SetupArm:
    T_world_imop = T_world_base @ se3.invert(panda.T_WORLD_BASE)
    try:
        from imop.sim.kinematics import reachable as reached

        T_imop_world = se3.invert(T_world_imop)
        reachable = lambda T: reached(T_imop_world @ T)  # noqa: E731
    except MissingExtra:
        reachable = None
    limits = panda.JOINT_LOWER, panda.JOINT_UPPER
    tip_pose = lambda q: np.asarray(T_world_imop @ panda.tip_pose(q))  # noqa: E731
    return SetupArm(tip_pose, *limits, panda.panda_self_filter(T_world_base), reachable)


def _simulated(name: str, T_world_base: FloatArray, home: FloatArray | None) -> SetupArm:
    from imop.sim.arms import find_arm, placed, self_filter

    arm = placed(find_arm(name), T_world_base)
    filtered = self_filter(arm)
    return _of(arm.home if home is None else home, arm.kinematics, arm.lower, arm.upper, filtered)


def _file(setup: Setup) -> SetupArm:
    from imop.sim.mink_kinematics import MinkKinematics
    from imop.sim.mjcf_filter import mjcf_self_filter

    robot, gripper = setup.robot, setup.gripper
    assert gripper is not None
    model = _compiled(Path(robot.model), gripper.flange, gripper.T_flange_gripper)
    filtered = mjcf_self_filter(model, robot.joints, gripper.fingers, robot.T_world_base)
    lower, upper = np.array([_limits(model, name) for name in robot.joints]).T
    place = lower, upper, robot.T_world_base
    kinematics = MinkKinematics(model, robot.joints, _TIP, robot.home, *place)
    return _of(robot.home, kinematics, lower, upper, filtered)


def _of(
    home: FloatArray, kinematics: Any, lower: FloatArray, upper: FloatArray, self_filter: SelfFilter
) -> SetupArm:
    def reachable(T_world_gripper: FloatArray) -> bool:
        return len(kinematics.inverse(T_world_gripper, home, 1)) > 0

    return SetupArm(kinematics.tip_pose, lower, upper, self_filter, reachable)


def _limits(model: Any, joint: str) -> FloatArray:
    found = model.joint(joint)
    return np.array(found.range if model.jnt_limited[found.id] else (-np.pi, np.pi))


def _compiled(path: Path, flange: str, T_flange_gripper: FloatArray) -> Any:
    """The model with a site for the gripper's tip."""
    import mujoco

    if not path.is_file():
        raise CorruptData(path, "the file is missing", "give the path of an MJCF or URDF file as robot.model")
    try:
        urdf = path.suffix == ".urdf"
        spec = mujoco.MjSpec.from_string(_urdf(path)) if urdf else mujoco.MjSpec.from_file(str(path))
        body, site = spec.body(flange), spec.site(flange)
        if body is None and site is None:
            names = ", ".join(b.name for b in spec.bodies if b.name)
            raise InvalidInput("gripper.flange", f"{flange!r} is not in {path.name}", names)
        T = T_flange_gripper
        if site is not None:
            body, T = site.parent, se3.make(se3.from_wxyz(site.quat), site.pos) @ T
        body.add_site(name=_TIP, pos=T[:3, 3], quat=se3.to_wxyz(T))
        return spec.compile()
    except (ValueError, ElementTree.ParseError) as error:
        if isinstance(error, InvalidInput):
            raise
        raise CorruptData(path, f"MuJoCo cannot read it ({error})", "mend what is said there") from error


def _urdf(path: Path) -> str:
    """The text of a URDF file that tells MuJoCo to keep shapes for the eye, and links without joints.

    Without it most flanges vanish. Meshes are looked for beside the file, or where its own extension for
    MuJoCo says.
    """
    root = ElementTree.parse(path).getroot()
    extension = root.find("mujoco")
    extension = ElementTree.SubElement(root, "mujoco") if extension is None else extension
    compiler = extension.find("compiler")
    compiler = ElementTree.SubElement(extension, "compiler") if compiler is None else compiler
    compiler.attrib |= {"fusestatic": "false", "discardvisual": "false"}
    compiler.attrib.setdefault("meshdir", ".")
    compiler.set("meshdir", str((path.parent / compiler.attrib["meshdir"]).resolve()))
    return ElementTree.tostring(root, encoding="unicode")
