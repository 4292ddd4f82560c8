"""What a matcher is: it finds the region of a demonstrated step again in another scene.

A matcher is asked once per demonstration to prepare its steps (find the invariant regions, compute what can
be computed ahead) and then once per action to match a prepared step against what is seen now. Registration
and networks stand behind the same two calls.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

from imop.geometry.cloud import PointCloud
from imop.geometry.perception import Ground, find_ground, open_ground, open_plane, with_normals
from imop.types import Action, BoolArray, FloatArray, Observation


@dataclass(frozen=True, eq=False)
class Scene:
    """One state as the policy works on it.

    Attributes:
        observation: the images, whose depth also says where nothing is, and the pose of the gripper.
        fused: the prepared cloud without the robot; it may be without normals.
    """

    observation: Observation
    fused: PointCloud

    @cached_property
    def _open(self) -> BoolArray:
        """(N,) which points are open ground."""
        return open_ground(self.fused.points)

    @cached_property
    def cloud(self) -> PointCloud:
        """The same points with normals; estimated once, for what needs them all."""
        if self.fused.normals is not None:
            return self.fused
        return with_normals(self.fused, self.observation, self._open)

    @cached_property
    def ground(self) -> Ground:
        """What of the cloud is bare ground; found once, without normals if much of it lies open."""
        plane = open_plane(self.fused.points[self._open])
        return find_ground(self.fused, plane) if plane else find_ground(self.cloud)


@dataclass(frozen=True, eq=False)
class Transition:
    """A demonstrated step (s_i, a_i, s_i').

    Attributes:
        before: the support state s_i.
        after: the state s_i' that the action led to.
        action: T_i and the gripper's state after it.
    """

    before: Scene
    after: Scene
    action: Action


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One way in which the region may have moved from the demonstrated scene into the observed one.

    Attributes:
        T_query_support: (4, 4) rigid motion, world frame to world frame.
        score: 0 .. 1, the share of the region that the observed points explain.
        p_support: (K, 3) points of the region that found a counterpart.
        p_query: (K, 3) the counterparts.
        generator: who proposed it, if that is known; see `candidates/proposals.py`.
        probability: 0 .. 1, of being right, if something was trained to tell it.
    """

    T_query_support: FloatArray
    score: float
    p_support: FloatArray
    p_query: FloatArray
    generator: str = ""
    probability: float | None = None


class PreparedStep(Protocol):
    """A demonstrated step with everything about it that does not depend on the query."""

    @property
    def region(self) -> FloatArray:
        """(M, 3) points of the invariant region in the demonstrated scene; may be empty."""
        ...

    def match(self, query: Scene, hints: Sequence[FloatArray] = ()) -> tuple[Hypothesis, ...]:
        """Where the region is in the query, best first; empty if it was not found.

        Args:
            query: the observed scene.
            hints: motions (4, 4) worth trying, such as the one found for the step before.
        """
        ...


class Matcher(Protocol):
    """Finds regions and matches them."""

    def prepare(self, steps: Sequence[Transition]) -> Sequence[PreparedStep]:
        """One prepared step for each demonstrated one; called once per demonstration."""
        ...
