"""Training pairs of recorded demonstrations of the same objects.

Nobody annotates anything: regions come from Eq. (3), right motions from the recorded action poses.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imop.demos.regions import SegmentedState, invariant_region, segmented
from imop.geometry.cloud import PointCloud
from imop.geometry.perception import Perception, RobotMask
from imop.networks.graph import thin
from imop.training.data.executed import ExecutedStep
from imop.training.data.invariance import INVARIANT
from imop.training.data.pairs import StepPair, next_carry
from imop.training.data.shards import STORED
from imop.training.recorded.symmetry import ColoredPoints, ObservedCloud, between_turns, equal_motions
from imop.types import Action, BoolArray, Demonstration, FloatArray, Observation

OPEN = 0.9
"""A gripper is open from here on, as a policy sees it."""
_FEWEST_REGION, _FEWEST_QUERY = 12, 10


@dataclass(frozen=True, eq=False)
class RecordedTake:
    """A demonstration as clouds: one for each step, and one after the last.

    Attributes:
        demonstration: where it comes from.
        full: what a policy would see, with instance ids.
        clouds: the same as training stores it.
        segments: for each step, its objects in the frame of its action.
    """

    demonstration: Demonstration
    full: tuple[PointCloud, ...]
    clouds: tuple[PointCloud, ...]
    segments: tuple[SegmentedState, ...]

    @property
    def observations(self) -> tuple[Observation, ...]:
        """What was seen before each step, and after the last."""
        return *(k.observation for k in self.demonstration.keyframes), self.demonstration.final

    @property
    def actions(self) -> list[Action]:
        """What was done in each step."""
        return [k.action for k in self.demonstration.keyframes]

    def goal(self, step: int) -> FloatArray:
        """T_world_goal (4, 4) of a step."""
        return self.demonstration.keyframes[step].action.T_world_gripper

    def later(self, step: int) -> list[FloatArray]:
        """T_world_goal (4, 4) of the steps after one."""
        return [self.goal(s) for s in range(step + 1, len(self.demonstration))]

    def part(self, step: int, names: Sequence[str]) -> PointCloud:
        """What is seen of these instances before a step."""
        return self.full[step].select(self.shows(self.full[step], step, names))

    def shows(self, cloud: PointCloud, step: int, names: Sequence[str]) -> BoolArray:
        """(N,) True for the points of a cloud of that step that belong to these instances."""
        known = self.observations[step].instance_names
        assert known is not None and cloud.ids is not None
        return np.isin(cloud.ids, [i for i, name in known.items() if name in names])


@dataclass(frozen=True, eq=False)
class RecordedStep(ExecutedStep[RecordedTake]):
    """A pair, and the takes that it comes from."""

    def right_poses(self) -> FloatArray:
        """(S, 4, 4) where the gripper may go in the query; of what is round, every 5 degrees."""
        return between_turns(self.pair.T_query_support) @ self.pair.T_world_goal


def segment(demonstration: Demonstration, robot_mask: RobotMask | None) -> RecordedTake:
    """Look at every state of a demonstration.

    Raises:
        InvalidInput: if it has no segmentation.
    """
    keyframes = demonstration.keyframes
    segments = tuple(segmented(keyframe) for keyframe in keyframes)
    perceive = Perception(robot_mask)
    full = tuple(perceive(o) for o in (*(k.observation for k in keyframes), demonstration.final))
    return RecordedTake(demonstration, full, tuple(thin(cloud, STORED)[0] for cloud in full), segments)


def group_pairs(takes: Sequence[RecordedTake]) -> list[RecordedStep]:
    """All pairs of takes of the same task, variation and objects: every step, in both directions.

    Steps whose region is hidden, or where nothing stays in place in the partners, give none.
    """
    found = []
    steps = min((len(t.demonstration) for t in takes), default=0)
    for step in range(steps):
        scenes = {id(t): ObservedCloud(t.full[step], t.observations[step]) for t in takes}
        for support in takes:
            names = region_names(support, takes, step)
            if not names:
                continue
            surface = ColoredPoints.pooled((t.part(step, names), t.goal(step)) for t in takes)
            for query in takes:
                if query is not support and visible(support, query, step, names):
                    asked = scenes[id(query)], support.goal(step), query.goal(step), query.later(step)
                    pair = step_pair(support, query, step, names, equal_motions(surface, *asked))
                    found.append(RecordedStep(pair, support, query, step))
    return found


def region_names(support: RecordedTake, takes: Sequence[RecordedTake], step: int) -> tuple[str, ...]:
    """The instances of the step's region among takes of the same objects; none if nothing stays in place."""
    others = [t.segments[step] for t in takes if t is not support]
    if not others:
        return ()
    region = invariant_region(support.segments[step], others)
    stays = bool(region.names) and region.displacement[region.names[0]] <= INVARIANT
    return region.names if stays else ()


def visible(support: RecordedTake, query: RecordedTake, step: int, names: Sequence[str]) -> bool:
    """Whether both see enough of these instances."""
    shown, seen = (t.shows(t.clouds[step], step, names).sum() for t in (support, query))
    return bool(shown >= _FEWEST_REGION and seen >= _FEWEST_QUERY)


def step_pair(
    support: RecordedTake,
    query: RecordedTake,
    step: int,
    names: Sequence[str],
    motions: FloatArray,
) -> StepPair:
    """The pair of a step whose region is these instances, with the right motions (S, 4, 4)."""
    keyframe = support.demonstration.keyframes[step]
    before = [k.observation for k in support.demonstration.keyframes]
    opened = [observation.gripper_opening > OPEN for observation in before]
    hands = [observation.T_world_gripper for observation in (*before, support.demonstration.final)]
    return StepPair(
        support.clouds[step],
        support.clouds[step + 1],
        query.clouds[step],
        support.shows(support.clouds[step], step, names),
        keyframe.action.T_world_gripper,
        keyframe.observation.T_world_gripper,
        (opened[step], keyframe.action.gripper_open),
        motions,
        carry=next_carry(opened, hands, support.clouds, step),
    )
