"""The invariant region of a demonstrated step, found without annotation: the paper's Eq. (3).

A segment (what moves rigidly together) belongs to the region if, seen from the gripper as the action leaves
it, it lies where it lies in the other demonstrations of the same step.
"""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from imop.errors import InvalidInput
from imop.geometry import cloud as clouds
from imop.geometry import se3
from imop.geometry.perception import WORKSPACE_LOWER, WORKSPACE_UPPER
from imop.types import FloatArray, Keyframe

Aim = tuple[str, int, int]
"""Task, variation, and seed of the objects (-1 if it is not known); see `DemonstrationStore.aims`."""

# Recordings of earlier versions call the robot panda.
BACKGROUND = ("floor", "wall", "table", "robot", "panda")
"""Instances that are never a region: the robot itself, and what stands still whatever is done."""
VOXEL = 0.004
"""Segments are thinned to this, metres, so that the wrist's close view does not outweigh the others."""
FEWEST = 8
"""A segment with fewer points counts as hidden."""
REACH = 0.05
"""What is farther from its partner counts as this far, metres."""
MARGIN = 0.006
"""Segments that stay as well as the best one up to this, metres, tie with it: views differ by some
millimetres, and what moves on its own is off by centimetres in most partners."""
_APART = 10.0
"""Along a fourth axis, metres, between what may not be matched."""


@dataclass(frozen=True, eq=False)
class SegmentedState:
    """The objects seen in a state, where the gripper of its action will see them.

    Attributes:
        names: of the objects that are seen.
        points: (N, 3) in the frame of the action pose T_i, metres.
        segment: (N,) index into `names`.
    """

    names: tuple[str, ...]
    points: FloatArray
    segment: NDArray[np.int64]


@dataclass(frozen=True)
class Region:
    """I(s_i).

    Attributes:
        names: the instances in the region, the most invariant first; none if nothing seen has a partner.
        displacement: instance -> how far its points are from those of its partners, metres.
    """

    names: tuple[str, ...]
    displacement: dict[str, float]


def by_aim(aims: Iterable[Aim]) -> dict[Aim, list[int]]:
    """Which demonstrations, by their number, show the same task, variation and objects."""
    found: dict[Aim, list[int]] = defaultdict(list)
    for number, aim in enumerate(aims):
        found[aim].append(number)
    return found


def segmented(keyframe: Keyframe, background: Sequence[str] = BACKGROUND) -> SegmentedState:
    """Segments of a keyframe's observation by their instance ids.

    Args:
        keyframe: of a demonstration that was not stripped.
        background: names of the instances to leave out.

    Raises:
        InvalidInput: if the observation has no instance ids or names, or no depth was measured.
    """
    observation = keyframe.observation
    cloud = clouds.fuse(observation)
    if cloud.ids is None or observation.instance_names is None:
        problem, accepted = "missing", "a demonstration with a segmentation, not stripped"
        raise InvalidInput("instance_ids, instance_names", problem, accepted)
    cloud = clouds.crop(cloud, WORKSPACE_LOWER, WORKSPACE_UPPER)
    assert cloud.ids is not None
    found = {}
    for instance, name in observation.instance_names.items():
        if name not in background and (cloud.ids == instance).any():
            found[name] = clouds.voxel_downsample(cloud.select(cloud.ids == instance), VOXEL).points
    seen = {name: p for name, p in found.items() if len(p) >= FEWEST}
    p_world = np.concatenate([np.zeros((0, 3)), *seen.values()])
    counts = [len(p) for p in seen.values()]
    p_action = se3.apply(se3.invert(keyframe.action.T_world_gripper), p_world)
    return SegmentedState(tuple(seen), p_action, np.repeat(np.arange(len(seen)), counts))


def invariant_region(support: SegmentedState, partners: Sequence[SegmentedState]) -> Region:
    """I(s_i) among the segments of `support`, by all states `partners` that call for the same action.

    The paper's class of a segment is the name of its instance.

    Raises:
        InvalidInput: if there is no partner.
    """
    if not partners:
        raise InvalidInput("partners", "none", "at least one other demonstration of the step")
    each = displacements(support, partners)
    mean = {
        name: float(np.nanmean(row))
        for name, row in zip(support.names, each, strict=True)
        if not np.isnan(row).all()
    }
    ranked = sorted(mean, key=lambda name: mean[name])
    return Region(tuple(n for n in ranked if mean[n] <= mean[ranked[0]] + MARGIN), mean)


def displacements(support: SegmentedState, partners: Sequence[SegmentedState]) -> FloatArray:
    """(segments of `support`, partners): how far a segment is from where the partner has it, metres.

    Distances are to the nearest point of the same segment. The two states see different parts of it, so it
    is the median over the points of whichever state sees less: what one of them sees, the other mostly
    saw, too. NaN where the partner does not see the segment.
    """
    count, several = len(support.names), len(partners)
    places = [np.array([_index(support.names, n) for n in state.names], dtype=np.int64) for state in partners]
    label = np.concatenate([place[s.segment] for place, s in zip(places, partners, strict=True)])
    partner = np.repeat(np.arange(several), [len(s.points) for s in partners])
    shared = label >= 0
    p_partners = np.concatenate([s.points for s in partners])[shared]
    label, partner = label[shared], partner[shared]
    if not len(label):
        return np.full((count, several), np.nan)
    forth = _distances(
        _labelled(np.tile(support.points, (several, 1)), _all_pairs(support.segment, several, count)),
        _labelled(p_partners, label + count * partner),
    ).reshape(several, -1)
    back = _distances(_labelled(p_partners, label), _labelled(support.points, support.segment))
    found = np.full((count, several), np.nan)
    for s in range(count):
        for j in range(several):
            here, there = forth[j, support.segment == s], back[(label == s) & (partner == j)]
            if len(there):
                found[s, j] = min(np.median(here), np.median(there))
    return found


def _index(names: tuple[str, ...], name: str) -> int:
    return names.index(name) if name in names else -1


def _all_pairs(segment: NDArray[np.int64], several: int, count: int) -> NDArray[np.int64]:
    """(several * N,) labels of the segments for each partner in turn."""
    return (segment[None, :] + count * np.arange(several)[:, None]).ravel()


def _labelled(points: FloatArray, label: NDArray[np.int64]) -> FloatArray:
    """(N, 4): points of different labels are out of each other's reach."""
    return np.column_stack([points, _APART * label])


def _distances(query: FloatArray, points: FloatArray) -> FloatArray:
    found, _ = cKDTree(points).query(query, distance_upper_bound=REACH)
    return np.minimum(found, REACH)
