"""What the gripper touches and carries in a demonstration, from its poses and what moved with it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imop.geometry import se3
from imop.geometry.clusters import Objects, connected
from imop.geometry.neighbours import nearest, within
from imop.policy.interfaces import Transition
from imop.types import BoolArray, FloatArray

# Two observations of one surface are this near to each other, metres.
SAME = 0.012
# What is grasped reaches at least this near to the tip, metres.
GRASP = 0.045
# A tip this near to something, without anything in the hand, presses or pushes it, metres.
TOUCH = 0.025


@dataclass(frozen=True, eq=False)
class Contacts:
    """What happens at the gripper in each of the K steps.

    Attributes:
        event: (K,) True for steps that end in a grasp, a release, or a press or push.
        holding: (K,) True for steps that begin with something in the hand.
        p_gripper_held: for each step the points (H, 3) of it that were seen to move along, gripper frame.
    """

    event: BoolArray
    holding: BoolArray
    p_gripper_held: tuple[FloatArray, ...]

    def following(self, step: int) -> int | None:
        """The first event at or after `step`."""
        later = np.flatnonzero(self.event[step:])
        return step + int(later[0]) if len(later) else None

    def taken(self, step: int, steps: Sequence[Transition]) -> FloatArray:
        """(H, 3) points, world frame, that `step` goes to take: the hand moves them after the next grasp.

        There are none if the hand holds something in this step, or if the step leaves what was let go before.
        """
        begins = np.flatnonzero(self.holding[step:])
        if not len(begins) or begins[0] == 0:
            return np.zeros((0, 3))
        first = step + int(begins[0])
        if self.event[:step].any() and step < first - 1 and leaving(steps[step], steps[first - 1]):
            return np.zeros((0, 3))
        free = np.flatnonzero(~self.holding[first:])
        last = first + int(free[0]) if len(free) else len(self.holding)
        # What was seen of it only grows while it is held.
        return se3.apply(steps[first].before.observation.T_world_gripper, self.p_gripper_held[last - 1])


def find_contacts(steps: Sequence[Transition], objects: Sequence[Objects]) -> Contacts:
    """Go through the demonstration; `objects` are those of each step's support state."""
    event, holding = np.zeros(len(steps), dtype=bool), np.zeros(len(steps), dtype=bool)
    held: list[FloatArray] = []
    known = np.zeros((0, 3))
    in_hand = False
    for k, (step, things) in enumerate(zip(steps, objects, strict=True)):
        holding[k] = in_hand
        if in_hand:
            T_gripper_world = se3.invert(step.before.observation.T_world_gripper)
            seen = things.cloud.points[_moves_along(step, things)]
            known = se3.apply(T_gripper_world, seen) if len(seen) > len(known) else known
        held.append(known)
        distance = nearest(step.action.T_world_gripper[None, :3, 3], things.cloud.points)[0].item()
        opens = step.action.gripper_open
        if in_hand:
            event[k] = opens
        else:
            grasps = not opens and is_open(step) and distance < GRASP
            event[k] = grasps or distance < TOUCH
            in_hand = grasps
        if opens:
            in_hand, known = False, np.zeros((0, 3))
    return Contacts(event, holding, tuple(held))


def leaving(step: Transition, event: Transition) -> bool:
    """Whether a step goes to a place nearer to where it begins than to where a later event takes place."""
    T_goal, T_now = step.action.T_world_gripper, step.before.observation.T_world_gripper
    away = se3.translation_distance(T_goal, event.action.T_world_gripper)
    return bool(se3.translation_distance(T_goal, T_now) < away)


def is_open(step: Transition) -> bool:
    """Whether the gripper is open before the step."""
    return step.before.observation.gripper_opening > 0.9


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
