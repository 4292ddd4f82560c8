"""Checks one demonstration: units, measurements, poses that must fit each other, steps that must follow."""

from collections.abc import Callable, Iterator

import numpy as np

from imop.demos.agreement import find_disagreement, reordered_quaternion
from imop.demos.findings import Finding
from imop.errors import InvalidInput
from imop.geometry import se3
from imop.geometry.cloud import fuse
from imop.types import Demonstration, FloatArray, Observation

# A table-top cell is a few metres; numbers beyond these are millimetres or degrees.
LARGEST_METRES = 20.0
LARGEST_RADIANS = 4 * np.pi
# Nothing is seen that near; a fraction of the stroke is far larger once the gripper has opened.
SMALLEST_DEPTH = 0.03
LARGEST_WIDTH = 0.1

REACHED = (0.02, np.deg2rad(10))
KINEMATIC = (0.02, np.deg2rad(5))
MOUNTED = (0.005, np.deg2rad(2))
GRIPPER_TO_SCENE = 0.15

TipPose = Callable[[FloatArray], FloatArray]


def check_demonstration(
    demonstration: Demonstration, where: str, tip_pose: TipPose | None = None
) -> Iterator[Finding]:
    """Everything that looks wrong in `demonstration`.

    Args:
        demonstration: as read from disk.
        where: how findings call it.
        tip_pose: the robot's forward kinematics, joint positions -> T_world_gripper; without it the
            joint positions are not compared with the gripper's poses.
    """
    observations = [*(k.observation for k in demonstration.keyframes), demonstration.final]
    wrong_units = list(_units(observations, where))
    yield from wrong_units
    yield from _opening(demonstration, observations, where)
    yield from _measurements(observations, where)
    yield from _cameras(observations, where)
    yield from _order(demonstration, observations, where)
    if wrong_units:
        return  # the rest would only repeat it
    yield from _agreement(observations, where)
    yield from _gripper_in_scene(observations, where)
    yield from _mounted_cameras(observations, where)
    if tip_pose is not None:
        yield from _kinematics(observations, where, tip_pose)


def _units(observations: list[Observation], where: str) -> Iterator[Finding]:
    for k, observation in enumerate(observations):
        here = f"{where}, step {k}"
        poses = {"T_world_gripper": observation.T_world_gripper}
        poses |= {f"camera {n}, T_world_camera": v.T_world_camera for n, v in observation.views.items()}
        for name, T in poses.items():
            distance = float(np.linalg.norm(T[:3, 3]))
            if distance > LARGEST_METRES:
                problem = f"the position is {distance:.4g} m from the world's origin"
                remedy = "give metres; if these are millimetres, divide by 1000"
                yield Finding("error", f"{here}, {name}", problem, remedy)
        for name, view in observation.views.items():
            depth = float(np.median(view.depth[view.measured])) if view.measured.any() else 0.0
            if depth > LARGEST_METRES:
                problem = f"the median depth is {depth:.4g} m"
                remedy = "give metres; if these are millimetres, divide by 1000"
                yield Finding("error", f"{here}, camera {name}, depth", problem, remedy)
            elif 0 < depth < SMALLEST_DEPTH:
                problem = f"the median depth is {depth:.4g} m, nearer than anything that a camera sees"
                remedy = "give metres along the optical axis; check how the images code depth"
                yield Finding("error", f"{here}, camera {name}, depth", problem, remedy)
        q = observation.joint_positions
        if q is not None and np.abs(q).max(initial=0.0) > LARGEST_RADIANS:
            problem = f"a joint is at {np.abs(q).max():.4g} rad"
            yield Finding("error", f"{here}, joint_positions", problem, "give radians, not degrees")


def _opening(demonstration: Demonstration, observations: list[Observation], where: str) -> Iterator[Finding]:
    """An open gripper must look open in some step, or the opening is not a fraction."""
    largest = max(o.gripper_opening for o in observations)
    if 0 < largest < LARGEST_WIDTH and any(k.action.gripper_open for k in demonstration.keyframes):
        problem = f"it is at most {largest:.3g}, though the gripper opens, as a width in metres is"
        remedy = (
            "give the fraction of the stroke, 0 closed .. 1 open; divide by the stroke, 0.08 m for the Panda"
        )
        yield Finding("error", f"{where}, gripper_opening", problem, remedy)


def _measurements(observations: list[Observation], where: str) -> Iterator[Finding]:
    for k, observation in enumerate(observations):
        for name, view in observation.views.items():
            here = f"{where}, step {k}, camera {name}"
            share = float(view.measured.mean())
            if share == 0:
                problem = "no pixel is a measurement: all are 0, NaN or inf"
                yield Finding(
                    "error", f"{here}, depth", problem, "record the depth again, or leave the camera out"
                )
            elif share < 0.05:
                problem = f"only {share:.1%} of the pixels are measurements"
                yield Finding("warning", f"{here}, depth", problem, "check the depth range of the camera")
            if view.rgb.size and np.all(view.rgb == view.rgb[0, 0]):
                yield Finding("warning", f"{here}, rgb", "the image has a single colour", "record it again")


def _cameras(observations: list[Observation], where: str) -> Iterator[Finding]:
    everywhere = {name for o in observations for name in o.views}
    for k, observation in enumerate(observations):
        for name in sorted(everywhere - set(observation.views)):
            problem = f"camera {name} is missing, other steps have it"
            yield Finding("error", f"{where}, step {k}, views", problem, "record it in every step or in none")


def _order(demonstration: Demonstration, observations: list[Observation], where: str) -> Iterator[Finding]:
    steps = [o.time_step for o in observations]
    if steps != list(range(steps[0], steps[0] + len(steps))):
        remedy = "restore the missing keyframes, or number the steps 0, 1, 2, ..."
        yield Finding("error", f"{where}, time_step", f"the steps are numbered {steps}", remedy)
    for k, keyframe in enumerate(demonstration.keyframes):
        after, action = demonstration.after(k), keyframe.action
        off = _distance(action.T_world_gripper, after.T_world_gripper)
        if _beyond(off, REACHED):
            problem = f"the action leads {_words(off)} away from where the next step begins"
            remedy = (
                "a keyframe is missing between them, or the action or the observation is of another moment"
            )
            yield Finding("error", f"{where}, step {k}, action.T_world_gripper", problem, remedy)
        before_opening, opening = keyframe.observation.gripper_opening, after.gripper_opening
        stayed_open = not action.gripper_open and min(before_opening, opening) > 0.95
        stayed_closed = action.gripper_open and max(before_opening, opening) < 0.2
        if stayed_open or stayed_closed:
            wanted = "open" if action.gripper_open else "close"
            problem = (
                f"it should {wanted} the gripper, whose opening goes {before_opening:.2f} -> {opening:.2f}"
            )
            remedy = "gripper_open is the state after the motion, gripper_opening 0 closed .. 1 open"
            yield Finding("warning", f"{where}, step {k}, action.gripper_open", problem, remedy)


def _agreement(observations: list[Observation], where: str) -> Iterator[Finding]:
    for found in find_disagreement(
        [{name: view for name, view in o.views.items() if view.measured.any()} for o in observations]
    ):
        here = f"{where}, {'camera' if len(found.cameras) == 1 else 'cameras'} {', '.join(found.cameras)}"
        if found.contradicting is None:
            problem = "sees nothing that another camera sees"
        else:
            problem = f"contradicts the other views in {found.contradicting:.0%} of what both see"
        remedy = "check T_world_camera, the intrinsics and the scale of the depth; calibrate again"
        if found.cure is not None:
            remedy = f"the views agree if {found.cure}"
        severe = found.cure is not None or (found.contradicting or 0.0) > 0.05
        yield Finding("error" if severe else "warning", here, problem, remedy)


def _gripper_in_scene(observations: list[Observation], where: str) -> Iterator[Finding]:
    """Cameras see the gripper or what it works on, unless robot and cameras are not in one frame."""
    nearest = []
    for observation in observations:
        try:
            points = fuse(observation).points
        except InvalidInput:
            return
        nearest.append(np.linalg.norm(points - observation.T_world_gripper[:3, 3], axis=1).min())
    if np.median(nearest) > GRIPPER_TO_SCENE:
        problem = f"nothing was seen within {np.median(nearest):.2f} m of the gripper"
        remedy = "express robot and cameras in one world frame (calibrate the cameras to the robot's base)"
        yield Finding("warning", f"{where}, T_world_gripper", problem, remedy)


def _mounted_cameras(observations: list[Observation], where: str) -> Iterator[Finding]:
    """A camera that moves is mounted on the hand, so its pose in the gripper's frame is constant."""
    for name in sorted(set.intersection(*(set(o.views) for o in observations))):
        cameras = np.array([o.views[name].T_world_camera for o in observations])
        grippers = np.array([o.T_world_gripper for o in observations])
        if not _varies(cameras) or not _varies(se3.invert(grippers) @ cameras):
            continue
        order = "the quaternion of {} is in another order than assumed (xyzw or wxyz)"
        here, problem = f"{where}, T_world_gripper", "camera {} moves, but not with the gripper"
        if any(not _varies(se3.invert(g) @ cameras) for g in _reordered(grippers)):
            remedy = "reorder it; imop's order is xyzw"
            yield Finding("error", here, order.format("the gripper's pose"), remedy)
        elif any(not _varies(se3.invert(grippers) @ c) for c in _reordered(cameras)):
            here = f"{where}, camera {name}, T_world_camera"
            yield Finding(
                "error", here, order.format("the camera's pose"), "reorder it; imop's order is xyzw"
            )
        else:
            remedy = "if it is mounted on the hand, compute its pose from the gripper's at the same moment"
            yield Finding("warning", f"{where}, camera {name}, T_world_camera", problem.format(name), remedy)


def _kinematics(observations: list[Observation], where: str, tip_pose: TipPose) -> Iterator[Finding]:
    known = [o for o in observations if o.joint_positions is not None and len(o.joint_positions) == 7]
    if not known:
        return
    expected = np.array([tip_pose(o.joint_positions) for o in known if o.joint_positions is not None])
    recorded = np.array([o.T_world_gripper for o in known])
    off = _distance(expected, recorded)
    if not _beyond(off, KINEMATIC):
        return
    if any(not _beyond(_distance(expected, T), KINEMATIC) for T in _reordered(recorded)):
        problem, remedy = (
            "the quaternion is in another order than assumed (xyzw or wxyz)",
            "reorder it to xyzw",
        )
        yield Finding("error", f"{where}, T_world_gripper", problem, remedy)
    else:
        problem = f"the gripper is {_words(off)} from where the joint positions put it"
        remedy = (
            "check the robot's base pose, the gripper frame (between the finger tips) and the joints' zeros"
        )
        yield Finding("warning", f"{where}, T_world_gripper", problem, remedy)


def _reordered(T: FloatArray) -> tuple[FloatArray, FloatArray]:
    pairs = [reordered_quaternion(one) for one in T]
    return np.array([a for a, _ in pairs]), np.array([b for _, b in pairs])


def _varies(T: FloatArray) -> bool:
    return _beyond(_distance(T[:1], T), MOUNTED)


def _distance(T_a: FloatArray, T_b: FloatArray) -> tuple[float, float]:
    """Largest distance, metres and radians."""
    T_a, T_b = np.broadcast_arrays(T_a, T_b)
    return float(np.max(se3.translation_distance(T_a, T_b))), float(np.max(se3.rotation_distance(T_a, T_b)))


def _beyond(distance: tuple[float, float], limit: tuple[float, float]) -> bool:
    return distance[0] > limit[0] or distance[1] > limit[1]


def _words(distance: tuple[float, float]) -> str:
    return f"{distance[0] * 100:.1f} cm and {np.rad2deg(distance[1]):.1f} degrees"
