"""The region that a demonstrated step is fixed to, found without labels.

What a step refers to shows in where the gripper goes and in what moves with it. An approach refers to the
thing that the gripper will close on next, a transport to the thing that the held object is set down at, a
retreat to the thing just left. The region is the whole cluster around that contact: small patches are
repeated too often to be found again (a drawer's handle looks like the other drawers').
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imop.geometry import se3
from imop.geometry.cloud import PointCloud
from imop.geometry.neighbours import nearest, within
from imop.policy.matcher import Transition
from imop.policy.objects import Objects, connected, find_objects
from imop.types import BoolArray, FloatArray

# Two observations of one surface are this near to each other, metres.
SAME = 0.012
# The held object reaches at least this near to the tip, metres.
GRASP = 0.04
# Weight of a point of the region falls with its distance from the contact; scale in metres.
FADING = 0.15
LEAST_WEIGHT = 0.2
# Lowest point of something that stands on the plane, metres; what is higher is fixed to something else.
STANDING = 0.04
# A cluster of fewer points (of a 5 mm grid) fits anywhere.
ENOUGH = 30
# What hangs in the air or is too small is taken with what lies this near to it, metres.
BORROWING = (0.04, 0.08, 0.16, 0.3)


@dataclass(frozen=True, eq=False)
class Region:
    """What a step is fixed to.

    Attributes:
        cloud: the region's points in the demonstrated scene, with normals; may be empty.
        weight: (M,) in (0, 1], larger near the contact.
        p_gripper_held: (H, 3) points of the held object in the gripper's frame, not part of the region; they
            have to be left out of the query as well.
    """

    cloud: PointCloud
    weight: FloatArray
    p_gripper_held: FloatArray


@dataclass(frozen=True, eq=False)
class _Contact:
    """Where a step's reference is touched: a pose of the gripper, and the points that touch."""

    T_world_gripper: FloatArray
    p_world: FloatArray


def find_regions(steps: Sequence[Transition]) -> list[Region]:
    """The region of every step of one demonstration."""
    objects = [find_objects(step.before.cloud) for step in steps]
    held = _held(steps, objects)
    return [_region(steps, k, objects[k], held[k]) for k in range(len(steps))]


def _is_open(step: Transition) -> bool:
    return step.before.observation.gripper_opening > 0.9


def _region(steps: Sequence[Transition], k: int, objects: Objects, p_gripper_held: FloatArray) -> Region:
    contact, exclude_held = _contact(steps, k, p_gripper_held)
    T_world_gripper = steps[k].before.observation.T_world_gripper
    held = np.zeros(len(objects), dtype=bool)
    if exclude_held:
        held = within(objects.cloud.points, se3.apply(T_world_gripper, p_gripper_held), SAME)
        if held.all():
            held[:] = False
    rest = Objects(objects.cloud.select(~held), objects.labels[~held], objects.height[~held])
    distance, index = nearest(contact.p_world, rest.cloud.points)
    member = rest.labels == rest.labels[index[np.argmin(distance)]]
    in_hand = not _is_open(steps[k]) and not exclude_held
    cloud = rest.cloud.select(member if in_hand else _with_support(rest, member))
    away, _ = nearest(cloud.points, contact.p_world)
    weight = np.maximum(np.exp(-0.5 * (away[:, 0] / FADING) ** 2), LEAST_WEIGHT)
    return Region(cloud, weight, p_gripper_held if held.any() else np.zeros((0, 3)))


def _with_support(objects: Objects, member: BoolArray) -> BoolArray:
    """(N,) the cluster, and if it hangs in the air what is around it: it must be fixed to something."""
    points = objects.cloud.points
    for reach in BORROWING:
        if member.sum() >= ENOUGH and objects.height[member].min() < STANDING:
            break
        near = within(points, points[member], reach)
        member = np.isin(objects.labels, np.unique(objects.labels[near]))
    return member


def _contact(steps: Sequence[Transition], k: int, p_gripper_held: FloatArray) -> tuple[_Contact, bool]:
    """The contact that step k refers to, and whether the held object is not part of the reference."""
    T_world_goal = steps[k].action.T_world_gripper
    T_world_now = steps[k].before.observation.T_world_gripper
    following = _next_event(steps, k)
    tip = np.zeros((1, 3))
    here = _Contact(T_world_now, se3.apply(T_world_now, tip))
    if following is None:
        if any(_changes(steps, m) for m in range(k)):
            return here, False
        T_event = _touching(steps, k)
        return _Contact(T_event, se3.apply(T_event, tip)), False
    T_event = steps[following].action.T_world_gripper
    if len(p_gripper_held):
        there = _Contact(T_event, se3.apply(T_event, p_gripper_held))
    else:
        there = _Contact(T_event, se3.apply(T_event, tip))
    came_from_event = any(_changes(steps, m) for m in range(k))
    leaving = se3.translation_distance(T_world_goal, T_world_now)
    arriving = se3.translation_distance(T_world_goal, T_event)
    if came_from_event and k != following and leaving < arriving:
        return here, False
    return there, bool(len(p_gripper_held))


def _changes(steps: Sequence[Transition], k: int) -> bool:
    """Whether step k opens or closes the gripper."""
    return steps[k].action.gripper_open != _is_open(steps[k])


def _next_event(steps: Sequence[Transition], k: int) -> int | None:
    return next((m for m in range(k, len(steps)) if _changes(steps, m)), None)


def _touching(steps: Sequence[Transition], k: int) -> FloatArray:
    """The pose, from step k on, whose tip comes nearest to anything: a press or a push without a grasp."""
    points = find_objects(steps[k].before.cloud).cloud.points
    tips = np.stack([step.action.T_world_gripper[:3, 3] for step in steps[k:]])
    distance, _ = nearest(tips, points)
    return steps[k + int(np.argmin(distance))].action.T_world_gripper


def _held(steps: Sequence[Transition], objects: Sequence[Objects]) -> list[FloatArray]:
    """For each step the points (H, 3) that the gripper holds during it, in its frame; maybe none."""
    held: list[FloatArray] = []
    known = np.zeros((0, 3))
    for step, things in zip(steps, objects, strict=True):
        if _is_open(step):
            known = np.zeros((0, 3))
        else:
            T_world_gripper = step.before.observation.T_world_gripper
            seen = things.cloud.points[_moves_along(step, things)]
            if len(seen) > len(known):
                known = se3.apply(se3.invert(T_world_gripper), seen)
        held.append(known)
    return held


def _moves_along(step: Transition, objects: Objects, least_motion: float = 0.02) -> BoolArray:
    """(N,) True for points in the hand that the step carries along with the gripper."""
    points = objects.cloud.points
    T_before, T_after = step.before.observation.T_world_gripper, step.after.observation.T_world_gripper
    T_motion = T_after @ se3.invert(T_before)
    moved = se3.apply(T_motion, points)
    after = step.after.cloud.points
    along: BoolArray = np.linalg.norm(moved - points, axis=1) > least_motion
    along &= within(moved, after, SAME) & ~within(points, after, SAME)
    if not along.any():
        return along
    indices = np.flatnonzero(along)
    labels = connected(points[indices])
    distance = np.linalg.norm(points[indices] - T_before[:3, 3], axis=1)
    first = int(np.argmin(distance))
    if distance[first] > GRASP:
        return np.zeros(len(points), dtype=bool)
    along[indices[labels != labels[first]]] = False
    return along
