"""A training example of the routing network: a demonstration, and states for which the step is asked."""

from dataclasses import dataclass

import numpy as np

from imop.errors import InvalidInput
from imop.geometry.cloud import PointCloud
from imop.types import BoolArray, FloatArray, as_array, as_pose


@dataclass(frozen=True, eq=False)
class SeenState:
    """What a robot sees and knows of itself in one state.

    Attributes:
        cloud: without the robot, with normals.
        T_world_gripper: (4, 4).
        opening: of the gripper, 0 closed .. 1 open.
    """

    cloud: PointCloud
    T_world_gripper: FloatArray
    opening: float

    def __post_init__(self) -> None:
        if not len(self.cloud):
            raise InvalidInput("cloud", "empty", "at least one point")
        as_pose("T_world_gripper", self.T_world_gripper)


@dataclass(frozen=True, eq=False)
class Query:
    """A state for which the step is asked.

    Attributes:
        seen: the state.
        before: what was seen before the last action; the state itself at the beginning.
        expected: number of the step that comes next if every action so far did what was demonstrated; the
            number of steps if all are done.
        right: (L,) True for the steps that are right: more than one where demonstrated states are the same.
        kind: the mishap that led to the state (`mishaps.Kind`); "ordinary" if all went as demonstrated.
    """

    seen: SeenState
    before: SeenState
    expected: int
    right: BoolArray
    kind: str = "ordinary"


@dataclass(frozen=True, eq=False)
class Route:
    """A demonstration and queries to it.

    Attributes:
        states: s_0 .. s_{L-1}, each before its step.
        queries: states of other executions; the one after the last step is among them only if it failed.
    """

    states: tuple[SeenState, ...]
    queries: tuple[Query, ...]

    def __post_init__(self) -> None:
        for query in self.queries:
            right = as_array("right", query.right, (len(self.states),), np.bool_)
            if not right.any():
                raise InvalidInput("right", "no step is right", "at least one True")
