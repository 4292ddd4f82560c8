"""The region that a demonstrated step is fixed to, found without labels.

Two things show what a step refers to: where the gripper goes, and what moves with it. An approach refers to
the thing that the gripper will close on next, a transport to the thing that the held object is set down at,
a retreat to the thing just left. The region is the whole cluster around that contact: small patches are
repeated too often to be found again (a drawer's handle looks like the other drawers').
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from imop.geometry import se3
from imop.geometry.cloud import PointCloud, concatenate
from imop.geometry.clusters import Objects, find_objects
from imop.geometry.neighbours import nearest, within
from imop.networks.region import trust
from imop.policy.contacts import SAME, Contacts, find_contacts, leaving
from imop.policy.interfaces import PolicyConfig, Transition
from imop.types import BoolArray, FloatArray

# What is next to the gripper: scale of the weights, metres.
NEXT = 0.05
# What is taken for the spread of points of which nothing is known, metres.
UNKNOWN = 0.01


@dataclass(frozen=True, eq=False)
class Region:
    """What a step is fixed to.

    Attributes:
        cloud: the region's points in the demonstrated scene, with normals.
        weight: (M,) in (0, 1], larger near the contact.
        p_gripper_held: (H, 3) points of the held object in the gripper's frame, if it is not part of the
            region; they have to be left out of the query as well.
        context: what the region is connected to. It may have moved on its own, so it only tells apart what
            the region alone does not: the two ends of a box without its latch.
        spread: (M,) metres, how far the counterpart of each point is expected from it on another thing of
            the same kind, both seen from the action; None if nothing is known.
    """

    cloud: PointCloud
    weight: FloatArray
    p_gripper_held: FloatArray
    context: PointCloud | None = None
    spread: FloatArray | None = None

    @cached_property
    def whole(self) -> PointCloud:
        """The region, then its context."""
        return self.cloud if self.context is None else concatenate([self.cloud, self.context])

    @cached_property
    def spreads(self) -> FloatArray:
        """(M,) the spread, or a usual one if nothing is known of it."""
        return np.full(len(self.cloud), UNKNOWN) if self.spread is None else self.spread

    @cached_property
    def trust(self) -> FloatArray:
        """(M,) weights of a fit to another thing; see `networks.region.trust`."""
        return trust(self.spreads)

    def next_to(self, p: FloatArray, reach: float) -> "Region":
        """What of the region is nearer than `reach` (metres) to its point nearest to `p` (3,), alone."""
        points = self.cloud.points
        anchor = points[nearest(p[None], points)[1][0, 0]]
        near = np.linalg.norm(points - anchor, axis=1) < reach
        return Region(self.cloud.select(near), self.weight[near], self.p_gripper_held)


@dataclass(frozen=True, eq=False)
class Goal:
    """What stands where a step takes the gripper, and stays there: a region that needs no network.

    Attributes:
        cloud: its points in the demonstrated scene, with normals.
        weight: (N,) in (0, 1], larger near the gripper.
        thing: (M, 3) points of the things that it is part of.
    """

    cloud: PointCloud
    weight: FloatArray
    thing: FloatArray


def fading(away: FloatArray) -> FloatArray:
    """(N,) in (0, 1], weights of points by their distance (N,) from the gripper, metres."""
    return np.asarray(np.exp(-0.5 * ((away - away.min()) / NEXT) ** 2))


def find_regions(steps: Sequence[Transition], config: PolicyConfig) -> list[Region]:
    """The region of every step of one demonstration."""
    objects = [find_objects(step.before.cloud, step.before.ground.plane) for step in steps]
    contacts = find_contacts(steps, objects)
    return [find_region(steps, k, objects[k], contacts, config) for k in range(len(steps))]


def find_region(
    steps: Sequence[Transition], k: int, objects: Objects, contacts: Contacts, config: PolicyConfig
) -> Region:
    """The region of step `k`; `objects` are those of its support state."""
    T_world_gripper = steps[k].before.observation.T_world_gripper
    p_held = contacts.p_gripper_held[k]
    T_contact = _ahead(steps, k, objects, contacts)
    touched = np.zeros((1, 3))
    if T_contact is None:
        T_contact = T_world_gripper
        in_hand, held = bool(contacts.holding[k]), np.zeros(len(objects), dtype=bool)
    else:
        in_hand, held = False, within(objects.cloud.points, se3.apply(T_world_gripper, p_held), SAME)
        touched = p_held if len(p_held) else touched
    if held.all():
        held[:] = False
    kept = ~held & steps[k].before.focused(objects.cloud.points, SAME)
    kept = kept if kept.any() else ~held
    rest = Objects(objects.cloud.select(kept), objects.labels[kept], objects.height[kept])
    p_contact = se3.apply(T_contact, touched)
    distance, index = nearest(p_contact, rest.cloud.points)
    member = rest.labels == rest.labels[index[np.argmin(distance)]]
    cloud = rest.cloud.select(member if in_hand else _with_support(rest, member, config))
    away, _ = nearest(cloud.points, p_contact)
    weight = np.maximum(np.exp(-0.5 * (away[:, 0] / config.fading) ** 2), config.least)
    return Region(cloud, weight, p_held if held.any() else np.zeros((0, 3)))


def _ahead(steps: Sequence[Transition], k: int, objects: Objects, contacts: Contacts) -> FloatArray | None:
    """T_world_gripper (4, 4) of the contact ahead that step k refers to.

    None if it refers to where the gripper is now: it leaves the last contact, or carries along what it holds.
    """
    following, begun = contacts.following(k), bool(contacts.event[:k].any())
    if following is None:
        return None if begun else _nearest_pass(steps[k:], objects)
    left = begun and k != following and leaving(steps[k], steps[following])
    return None if left else steps[following].action.T_world_gripper


def _nearest_pass(steps: Sequence[Transition], objects: Objects) -> FloatArray:
    """The pose whose tip comes nearest to anything, for demonstrations that never touch."""
    tips = np.stack([step.action.T_world_gripper[:3, 3] for step in steps])
    distance, _ = nearest(tips, objects.cloud.points)
    return steps[int(np.argmin(distance))].action.T_world_gripper


def _with_support(objects: Objects, member: BoolArray, config: PolicyConfig) -> BoolArray:
    """(N,) the cluster, and if it hangs in the air what is around it: it must be fixed to something."""
    points = objects.cloud.points
    for reach in config.borrowed:
        if member.sum() >= config.fewest and objects.height[member].min() < config.standing:
            break
        near = within(points, points[member], reach)
        member = np.isin(objects.labels, np.unique(objects.labels[near]))
    return member
