"""Training pairs of recorded demonstrations of the same task with other objects.

The region is what stays in place among demonstrations of each set of objects. What is as right in the query
is found there, as for the same objects. Nobody sees an object whole, so some labels stay unknown.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imop.geometry import se3
from imop.training.data.invariance import INVARIANT, distances, has_invariant_part
from imop.training.recorded.segmented import (
    RecordedStep,
    RecordedTake,
    region_names,
    step_pair,
    visible,
)
from imop.training.recorded.symmetry import ColoredPoints, ObservedCloud, equal_motions
from imop.types import FloatArray


def other_pairs(first: Sequence[RecordedTake], second: Sequence[RecordedTake]) -> list[RecordedStep]:
    """Pairs of takes of two sets of objects, one take of each at a time: every step, in both directions.

    Steps whose region is hidden or another one, or where nothing stays in place, give none.
    """
    found = []
    steps = min((len(t.demonstration) for t in (*first, *second)), default=0)
    for step in range(steps):
        names = _shared(first, second, step)
        if names:
            found += _pairs(first, second, step, names) + _pairs(second, first, step, names)
    return found


def _shared(first: Sequence[RecordedTake], second: Sequence[RecordedTake], step: int) -> tuple[str, ...]:
    """The instances of the region of both; none if what is the most invariant of one is not of the other."""
    one, other = (region_names(takes[0], takes, step) for takes in (first, second))
    agreed = one and other and one[0] in other and other[0] in one
    return tuple(name for name in one if name in other) if agreed else ()


def _pairs(
    shown: Sequence[RecordedTake],
    asked: Sequence[RecordedTake],
    step: int,
    names: Sequence[str],
) -> list[RecordedStep]:
    scenes = [ObservedCloud(t.full[step], t.observations[step]) for t in asked]
    surface = ColoredPoints.pooled((t.part(step, names), t.goal(step)) for t in asked)
    found = []
    for support, query, scene in zip(shown, asked, scenes, strict=False):
        if not visible(support, query, step, names):
            continue
        goal = query.goal(step)
        within = equal_motions(surface, scene, goal, goal, query.later(step))
        pair = step_pair(support, query, step, names, within @ goal @ se3.invert(support.goal(step)))
        label = _label(support, asked, scenes, step, names)
        if has_invariant_part(label):
            found.append(RecordedStep(replace(pair, invariance=label), support, query, step))
    return found


def _label(
    support: RecordedTake,
    asked: Sequence[RecordedTake],
    scenes: Sequence[ObservedCloud],
    step: int,
    names: Sequence[str],
) -> FloatArray:
    """(N,) `StepPair.invariance`, against what all takes saw of the other objects.

    A point far from all of that has no label unless a camera saw that nothing is where it would be: its
    counterpart may be hidden.
    """
    cloud, T_goal_world = support.clouds[step], se3.invert(support.goal(step))
    found = np.full(len(cloud), np.nan)
    for name in names:
        mine = support.shows(cloud, step, [name])
        others = ColoredPoints.pooled((t.part(step, [name]), t.goal(step)) for t in asked).points
        if mine.any() and len(others):
            found[mine] = distances(cloud.points[mine], support.goal(step), others, np.eye(4))
    far = np.flatnonzero(found > INVARIANT)
    seen = se3.apply(T_goal_world, cloud.points[far])
    absent = np.zeros(len(far), dtype=bool)
    for take, scene in zip(asked, scenes, strict=True):
        absent |= scene.seen_through(se3.apply(take.goal(step), seen))
    found[far[~absent]] = np.nan
    return found
