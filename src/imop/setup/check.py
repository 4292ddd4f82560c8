"""What is wrong with a set-up, as far as it can be told without moving anything."""

from collections.abc import Iterator

import numpy as np

from imop.demos.findings import Finding
from imop.errors import ImopError, InvalidInput
from imop.geometry import se3
from imop.geometry.cloud import crop, fuse
from imop.geometry.perception import supporting_plane, views_of_hand
from imop.setup.arm import SetupArm, arm_of
from imop.setup.setup import CameraSetup, Setup
from imop.types import FloatArray, Observation

FEW_SEEN = 0.1
"""A camera that sees less of the table than this share does not help."""
MUCH_MORE = 0.3
"""A pose read in another way is the likelier one if it sees so much more of the table."""
REACH = 1.5
"""No arm on a table reaches farther, metres."""
MOUNTED = 0.4
"""No camera is farther from the tip of the gripper that it is mounted on, metres."""
TABLE_OFF = 0.015
"""The table is seen at most so far from its height, metres."""
LARGEST, SMALLEST = 4.0, 0.1
"""Edges of a workspace, metres."""


def check_setup(setup: Setup, seen: Observation | None = None, arm: SetupArm | None = None) -> list[Finding]:
    """Everything that looks wrong.

    Args:
        setup: as read from its file.
        seen: an observation of this set-up, in its world frame, to compare it with.
        arm: of the set-up, if it is known already.
    """
    findings = [*_workspace(setup)]
    try:
        arm = arm or arm_of(setup)
        findings += _home(setup, arm)
    except ImopError as error:
        findings.append(Finding.of(error, "robot.model"))
    for name, camera in setup.cameras.items():
        findings += _camera(setup, f"cameras.{name}", camera)
    findings += _same_place(setup)
    if seen is not None:
        findings += _seen(setup, arm, seen)
    return findings


def _workspace(setup: Setup) -> Iterator[Finding]:
    lower, upper = setup.workspace.lower, setup.workspace.upper
    edges = upper - lower
    if edges.max() > LARGEST or edges.min() < SMALLEST:
        problem = f"its edges are {np.round(edges, 3).tolist()} m"
        remedy = "give the box that things and the gripper stay in, in metres"
        yield Finding("warning", "workspace", problem, remedy)
    base = setup.robot.T_world_base[:3, 3]
    away = float(np.linalg.norm(base - np.clip(base, lower, upper)))
    if away > REACH:
        problem = f"it begins {away:.2f} m away from the robot's base"
        remedy = "give lower, upper and T_world_base in one frame; is T_world_base inverted?"
        yield Finding("error", "workspace", problem, remedy)


def _home(setup: Setup, arm: SetupArm) -> Iterator[Finding]:
    home = setup.robot.home
    if len(home) != len(arm.lower):
        problem, remedy = f"it has {len(home)} positions", f"give {len(arm.lower)}, one for each joint"
        yield Finding("error", "robot.home", problem, remedy)
        return
    outside = np.flatnonzero((home < arm.lower) | (home > arm.upper))
    for joint in outside:
        allowed = f"{arm.lower[joint]:.2f} .. {arm.upper[joint]:.2f} rad"
        problem = f"joint {joint + 1} is at {home[joint]:.2f} rad, outside of {allowed}"
        yield Finding("error", "robot.home", problem, "give radians within the limits")
    p = arm.tip_pose(home)[:3, 3]
    if p[2] < setup.workspace.table_height:
        problem = f"the gripper is at {np.round(p, 3).tolist()} m there, below the table"
        remedy = "check home, T_world_base, table_height and the gripper's tip"
        yield Finding("error", "robot.home", problem, remedy)
    elif np.any(p < setup.workspace.lower) or np.any(p > setup.workspace.upper):
        problem = f"the gripper is at {np.round(p, 3).tolist()} m there, outside of the workspace"
        yield Finding("warning", "robot.home", problem, "choose another home, or a larger workspace")


def _camera(setup: Setup, where: str, camera: CameraSetup) -> Iterator[Finding]:
    if camera.T_gripper_camera is not None:
        yield from _mounted(where, camera.T_gripper_camera)
        return
    assert camera.T_world_camera is not None
    given = camera.T_world_camera
    share = _share_seen(setup, camera, given)
    inverted = _share_seen(setup, camera, se3.invert(given))
    flipped = _share_seen(setup, camera, given @ se3.make(se3.euler(x=np.pi)))
    if share >= FEW_SEEN and max(inverted, flipped) < share + MUCH_MORE:
        return
    problem = f"it sees {share:.0%} of the table in the workspace"
    remedy = "measure its pose: x right, y down, z forward, in the world"
    if inverted >= share + MUCH_MORE:
        remedy = "its pose is probably inverted: give T_world_camera, not T_camera_world"
    elif flipped >= share + MUCH_MORE:
        remedy = "its axes are probably OpenGL's: y and z point the other way, x right, y down, z forward"
    yield Finding("error", f"{where}.T_world_camera", problem, remedy)


def _mounted(where: str, T_gripper_camera: FloatArray) -> Iterator[Finding]:
    away = float(np.linalg.norm(T_gripper_camera[:3, 3]))
    if away > MOUNTED:
        problem = f"it is {away:.2f} m away from the tip of its gripper"
        remedy = "give metres, from the tip between the fingers"
        yield Finding("error", f"{where}.T_gripper_camera", problem, remedy)
    if T_gripper_camera[2, 2] < 0:
        problem = "it looks against the direction in which the fingers point"
        remedy = "is the pose inverted, or z not forward? +z of the gripper is where the fingers point"
        yield Finding("warning", f"{where}.T_gripper_camera", problem, remedy)


def _share_seen(setup: Setup, camera: CameraSetup, T_world_camera: FloatArray) -> float:
    """Share of the table in the workspace that is in the image; nothing is seen from below the table."""
    space = setup.workspace
    x, y = (np.linspace(space.lower[i], space.upper[i], 21) for i in (0, 1))
    table = np.stack([*(v.ravel() for v in np.meshgrid(x, y)), np.full(441, space.table_height)], axis=1)
    p = se3.apply(se3.invert(T_world_camera), table)
    ahead = p[:, 2] > 0.05
    uv = (p @ camera.intrinsics.T)[:, :2] / np.where(ahead, p[:, 2], 1.0)[:, None]
    inside = ahead & np.all((uv >= 0) & (uv < camera.size), axis=1)
    return float(np.mean(inside)) if T_world_camera[2, 3] > space.table_height else 0.0


def _same_place(setup: Setup) -> Iterator[Finding]:
    standing = {n: c.T_world_camera for n, c in setup.cameras.items() if c.T_world_camera is not None}
    names = list(standing)
    for i, first in enumerate(names):
        for second in names[i + 1 :]:
            if se3.near(standing[first], standing[second], 0.01, 0.02):
                problem = f"it stands where {first} does"
                yield Finding("warning", f"cameras.{second}", problem, "give each camera its own pose")


def _seen(setup: Setup, arm: SetupArm | None, seen: Observation) -> Iterator[Finding]:
    lacking = {c.seen_as or n for n, c in setup.cameras.items()} - set(seen.views)
    if lacking:
        remedy = "record with all cameras, or give seen_as, by which the recording calls one"
        yield Finding("error", "cameras", f"the observation has no {', '.join(sorted(lacking))}", remedy)
    try:
        cloud = setup.workspace.perception(None)(seen)
    except InvalidInput as error:
        yield Finding.of(error, "observation")
        return
    plane = supporting_plane(cloud)
    height = None if plane is None else plane.offset
    if height is None or abs(height - setup.workspace.table_height) > TABLE_OFF:
        found = "no table is seen" if height is None else f"the table is seen at {height:.3f} m"
        problem = f"{found}, not at {setup.workspace.table_height:.3f} m"
        remedy = "measure table_height again, or calibrate the cameras"
        yield Finding("warning", "workspace.table_height", problem, remedy)
    if arm is not None:
        yield from _robot_in(setup, arm, seen)


def _robot_in(setup: Setup, arm: SetupArm, seen: Observation) -> Iterator[Finding]:
    q = seen.joint_positions
    if q is None or len(q) != len(arm.lower):
        problem = "missing" if q is None else f"{len(q)} of them"
        yield Finding("error", "joint_positions", problem, f"record those of all {len(arm.lower)} joints")
        return
    off = float(se3.translation_distance(arm.tip_pose(q), seen.T_world_gripper))
    if off > 0.01:
        problem = f"the joints put the gripper {off * 1000:.0f} mm from where the observation has it"
        remedy = "check gripper.tip, T_world_base, the model and the order of the joints"
        yield Finding("error", "robot", problem, remedy)
    cloud = crop(fuse(seen), setup.workspace.lower, setup.workspace.upper)
    robot = arm.self_filter.is_robot(cloud.points, q, seen.gripper_opening)
    if not np.any(robot) and views_of_hand(seen):
        problem = "the self-filter removes nothing, although the hand is in view"
        yield Finding("error", "robot", problem, "check T_world_base, the joints' order and the model")
