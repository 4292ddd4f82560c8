"""What the parts of the policy hand to each other: scenes, steps, candidates, and what a matcher is.

A matcher is asked once per demonstration to prepare its steps (find the invariant regions, compute what can
be computed ahead) and then once per action to locate a prepared step's region in what is seen now. Networks
and descriptors stand behind the same two calls, and before the same search.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np

from imop.geometry.cloud import PointCloud
from imop.geometry.neighbours import within
from imop.geometry.perception import Ground, find_ground, open_ground, open_plane, with_normals
from imop.types import Action, BoolArray, FloatArray, Observation

Feasible = Callable[[FloatArray], bool]
"""Whether the arm can take the gripper to T_world_gripper (4, 4)."""


@dataclass(frozen=True)
class PolicyConfig:
    """All that is set by hand in the search; chosen on training families and base tasks, seeds below 1000.

    Attributes:
        enough: probability of a candidate from which no further generator is asked.
        threshold: least probability of a region point.
        refined: seeds of one part of the region that are refined by closest points.
        judged: refined motions of one stage that are judged.
        tried: how many of the best are also tried in their half turn, straight, and upright.
        counterparts: query points per region point that may be matched.
        samples: triples that are drawn from the matches.
        turns, places: upright turns of one place, and how many things the region is set upright on.
        painted: turns of something round of which its paint chooses; closest points cannot turn it.
        among: a turn of something round is seen beside so many others.
        tight, loose: matches nearer than this to where a motion carries them speak for it, metres.
        next_to: what of the region is this near to where the gripper goes is a part of its own, metres.
        same_motion: motions nearer to each other than this, metres and radians, are judged once.
        fewest: a cluster of fewer points does not count as a thing; it would fit anywhere.
        alone: a part of the region is looked for on its own if it is less than this share of the region.
        known: what the hand takes is told from the rest of the region if the region has this share of it.
        lets_go: share of what is held in the region of a step that lets go from which nothing else is in it.
        scrap, farther: a region of fewer points is not believed if it is farther from where the gripper goes
            than something else is, by so many metres.
        goal: what stands farther from where the gripper goes is no goal, metres.
        connected: what is connected to the region, this near to it (metres), is its context.
        borrowed: what hangs in the air or is too small is taken with what lies this near to it, metres.
        standing: lowest point of something that stands on the ground, metres.
        fading, least: weight of a point of a region without networks falls with its distance from the
            contact on this scale, metres, to this.
        laid: points of a part that are laid onto the scene, first and last.
        compared: points of the region, of its context, and of what was observed around it, that are compared.
        glanced: points of the region and of its context that are compared at a glance.
        keypoints: points of the region, and of a scene, that registration describes.
        focused: share of what is next to the gripper that has to be in focus, if a focus is given.
        without: generators (`proposals.py`) that are not asked, to measure what they bring.
    """

    enough: float = 0.9
    threshold: float = 0.5
    refined: int = 8
    judged: int = 12
    tried: int = 3
    counterparts: int = 2
    samples: int = 4000
    turns: int = 24
    places: int = 2
    painted: int = 72
    among: int = 24
    tight: float = 0.015
    loose: float = 0.03
    next_to: float = 0.05
    same_motion: tuple[float, float] = (0.002, 0.02)
    fewest: int = 30
    alone: float = 0.8
    known: float = 0.5
    lets_go: float = 0.8
    scrap: int = 100
    farther: float = 0.05
    goal: float = 0.15
    connected: float = 0.1
    borrowed: tuple[float, ...] = (0.04, 0.08, 0.16, 0.3)
    standing: float = 0.04
    fading: float = 0.15
    least: float = 0.2
    laid: tuple[int, int] = (250, 1000)
    compared: tuple[int, int, int] = (400, 150, 200)
    glanced: tuple[int, int] = (100, 40)
    keypoints: tuple[int, int] = (800, 2500)
    focused: float = 0.5
    without: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Scene:
    """One state as the policy works on it.

    Attributes:
        observation: the images, whose depth also says where nothing is, and the pose of the gripper.
        fused: the prepared cloud without the robot; it may be without normals.
        focus: (N,) which points of the cloud are meant, if somebody said so.
    """

    observation: Observation
    fused: PointCloud
    focus: BoolArray | None = None

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

    def focused(self, points: FloatArray, reach: float) -> BoolArray:
        """(N,) which points (N, 3) are nearer than `reach` (metres) to what is meant; all if nobody said."""
        if self.focus is None:
            return np.ones(len(points), dtype=bool)
        return within(points, self.fused.points[self.focus], reach)

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
class Tried:
    """A pose of the gripper that was tried for a step, in vain.

    Attributes:
        T_world_gripper: (4, 4).
        luck: 0 .. 1, how likely it would have come to nothing if it had been right.
    """

    T_world_gripper: FloatArray
    luck: float


@dataclass(frozen=True, eq=False)
class Progress:
    """What an episode did so far.

    Attributes:
        T_last: (4, 4) the motion that was found for the step before, from the demonstrated scene to the
            observed one; None at the beginning.
        tried: poses of the step in question that came to nothing before.
    """

    T_last: FloatArray | None = None
    tried: tuple[Tried, ...] = ()


BEGINNING = Progress()


def _no_points() -> FloatArray:
    return np.zeros((0, 3))


@dataclass(frozen=True, eq=False)
class Candidate:
    """One way in which the region may have moved from the demonstrated scene into the observed one.

    Attributes:
        T_query_support: (4, 4) rigid motion, world frame to world frame.
        probability: 0 .. 1, of being right.
        p_support: (K, 3) points of the region that found a counterpart; none but for the first candidate.
        p_query: (K, 3) the counterparts.
        generator: which generator proposed it; see `proposals.py`.
        reachable: whether the arm can follow it; None if that was not asked.
    """

    T_query_support: FloatArray
    probability: float
    p_support: FloatArray = field(default_factory=_no_points)
    p_query: FloatArray = field(default_factory=_no_points)
    generator: str = ""
    reachable: bool | None = None


class PreparedStep(Protocol):
    """A demonstrated step with everything about it that does not depend on the query."""

    @property
    def region(self) -> FloatArray:
        """(M, 3) points of the invariant region in the demonstrated scene; may be empty."""
        ...

    @property
    def spread(self) -> FloatArray | None:
        """(M,) metres, how far from each point of the region its counterpart on another thing may be.

        Both are seen from the action, so a small spread means what is invariant. None if nothing is known.
        """
        ...

    def locate(
        self, query: Scene, progress: Progress = BEGINNING, feasible: Feasible | None = None
    ) -> tuple[Candidate, ...]:
        """Where the region may be in the query, likeliest first; empty if nothing is seen.

        Args:
            query: the observed scene.
            progress: of the episode.
            feasible: whether the arm can take the gripper to a pose; the likeliest candidate that it can
                follow then comes before all others.
        """
        ...


class Matcher(Protocol):
    """Finds regions and locates them."""

    def prepare(self, steps: Sequence[Transition]) -> Sequence[PreparedStep]:
        """One prepared step for each demonstrated one; called once per demonstration."""
        ...
