"""Prediction on recorded data: what would the policy have done in each recorded state?

`predict` lets the policy choose the step itself. `ask` tells it the step (`told.py`), so that finding the
right pose and choosing the right step are measured apart; which poses are right is said in `equal_poses`.
"""

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from imop.errors import NoConfidentMatch
from imop.evaluation.appearance import Appearance
from imop.evaluation.equal_poses import equal_poses
from imop.evaluation.methods import Policy
from imop.evaluation.open_loop_rows import Row
from imop.evaluation.oracle import OraclePolicy
from imop.evaluation.told import Told
from imop.geometry import cloud as clouds
from imop.geometry import se3
from imop.geometry.accuracy import COARSE, errors
from imop.geometry.neighbours import nearest, within
from imop.geometry.perception import WORKSPACE_LOWER, WORKSPACE_UPPER
from imop.policy.one_shot import OneShotPolicy
from imop.types import Action, Demonstration, FloatArray, Keyframe, Observation

THINNED = 0.005
"""Metres between the points that regions are compared on."""
COVERED = 0.01
"""A point of the object is in the region if the region has a point this near, metres."""


class RecordedPoses:
    """What the oracle asks for, at a recorded keyframe instead of in a simulator."""

    def __init__(self) -> None:
        self.keyframe: Keyframe | None = None

    def pose(self, body: str) -> FloatArray:
        """T_world_body (4, 4) at the keyframe, which has to be fixed to this body."""
        assert self.keyframe is not None and self.keyframe.T_world_object is not None
        assert self.keyframe.object_name == body
        return self.keyframe.T_world_object


@dataclass(frozen=True, eq=False)
class Case:
    """A demonstration and the recorded scenes that are asked for after it.

    Attributes:
        task: its name in the report.
        support: name of the demonstration in the report.
        demonstration: with privileged names and poses, if there are any.
        queries: recordings of the same task and variation by their names in the report.
        appearance: of the demonstrated objects; None if it is unknown, then only recorded poses are right.
        others: appearances of the objects of those queries that show others than the demonstration.
    """

    task: str
    support: str
    demonstration: Demonstration
    queries: dict[str, Demonstration]
    appearance: Appearance | None = None
    others: Mapping[str, Appearance] = field(default_factory=dict)

    def right_poses(self, query: str, step: int) -> FloatArray:
        """(N, 4, 4) T_world_gripper that are right for a step of a query, the recorded one first."""
        other = self.others.get(query)
        if other is None:
            return equal_poses(self.queries[query], step, self.appearance)
        return equal_poses(self.queries[query], step, other, self.demonstration)


OnRow = Callable[[Row, Case, Action | None], None]


def ask(
    method: str, make: Callable[[RecordedPoses], Policy], case: Case, on_row: OnRow | None = None
) -> Iterator[Row]:
    """Show the demonstration to a fresh policy and ask it for the same step at each keyframe of each query.

    Args:
        method: name in the rows.
        make: makes the policy; is given the poses that an oracle may read.
        case: what is shown and asked.
        on_row: called with every row and the action behind it.

    Raises:
        ImopError: as the policy does, but for `NoConfidentMatch`, which makes a row without a prediction.
    """
    poses = RecordedPoses()
    policy = make(poses)
    shown = case.demonstration
    policy.watch(shown if isinstance(policy, OraclePolicy) else shown.stripped())
    asked = Told(policy) if isinstance(policy, OneShotPolicy) else policy
    overlaps: dict[int, float | None] = {}
    for query, recorded in case.queries.items():
        asked.reset()
        for step in range(min(len(shown), len(recorded))):
            poses.keyframe = recorded.keyframes[step]
            action, row = _answer(method, asked, case, query, step)
            if action and action.match and step not in overlaps:
                overlaps[step] = _overlap(case, step, action.match.region)
            row = replace(row, region_iou=overlaps.get(step))
            if on_row:
                on_row(row, case, action)
            yield row


def _answer(
    method: str, asked: Policy | Told, case: Case, query: str, step: int
) -> tuple[Action | None, Row]:
    """What the policy answers, and the row that follows from it."""
    recorded = case.queries[query]
    keyframe = recorded.keyframes[step]
    observation = keyframe.observation.stripped()
    row = Row(method, case.task, recorded.variation, case.support, query, step, keyframe.object_name)
    right = case.right_poses(query, step)
    row = replace(row, repeatable=_repeats(case.demonstration.keyframes[step], keyframe, right))
    action = None
    started = time.perf_counter()
    try:
        action = asked.act(observation, step) if isinstance(asked, Told) else asked.act(observation)
    except NoConfidentMatch as error:
        row = replace(row, problem=str(error))
    row = replace(row, milliseconds=1000 * (time.perf_counter() - started))
    if isinstance(asked, Told):
        row = replace(row, routed=asked.routed)
    return action, _compared(row, action, right) if action else row


def _repeats(shown: Keyframe, asked: Keyframe, right: FloatArray) -> bool:
    motion = se3.invert(shown.observation.T_world_gripper) @ shown.action.T_world_gripper
    position, rotation = errors(asked.observation.T_world_gripper @ motion, right)
    return bool(position < COARSE[0] and rotation < np.radians(COARSE[1]))


def _compared(row: Row, action: Action, right: FloatArray) -> Row:
    position, rotation = errors(action.T_world_gripper, right)
    plain_position, plain_rotation = errors(action.T_world_gripper, right[:1])
    return replace(
        row,
        pose=tuple(se3.to_pose7(action.T_world_gripper).tolist()),
        position=position,
        rotation=float(np.degrees(rotation)),
        plain_position=plain_position,
        plain_rotation=float(np.degrees(plain_rotation)),
        confidence=action.confidence,
    )


def _overlap(case: Case, step: int, region: FloatArray) -> float | None:
    keyframe = case.demonstration.keyframes[step]
    if case.appearance is None or keyframe.object_name is None:
        return None
    return region_iou(region, keyframe.observation, case.appearance.instance(keyframe.object_name))


def region_iou(region: FloatArray, observation: Observation, instance: str) -> float | None:
    """Intersection over union of a region and of what is seen of an instance.

    Does not depend on how densely the region is sampled: it follows from both shares of `region_shares`,
    which see for the arguments. None if they are unknown.
    """
    shares = region_shares(region, observation, instance)
    if shares is None:
        return None
    precision, recall = shares
    return precision * recall / (precision + recall - precision * recall) if precision and recall else 0.0


def region_shares(region: FloatArray, observation: Observation, instance: str) -> tuple[float, float] | None:
    """The share of a region that lies on an instance, and that of the instance that lies near the region.

    Args:
        region: (M, 3) points, world frame.
        observation: with instance ids.
        instance: name of one of its instances.

    Returns:
        0 .. 1 each, or None if nothing is seen of the instance or the ids are unknown.
    """
    cloud = clouds.crop(clouds.fuse(observation), WORKSPACE_LOWER, WORKSPACE_UPPER)
    names = observation.instance_names or {}
    numbers = [number for number, name in names.items() if name == instance]
    if cloud.ids is None or not np.isin(cloud.ids, numbers).any():
        return None
    if not len(region):
        return 0.0, 0.0
    _, index = nearest(region, cloud.points)
    precision = float(np.isin(cloud.ids[index[:, 0]], numbers).mean())
    seen = clouds.voxel_downsample(cloud.select(np.isin(cloud.ids, numbers)), THINNED)
    return precision, float(within(seen.points, region, COVERED).mean())
