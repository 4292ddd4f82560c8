"""From many guesses where a region went to few that explain what is seen: judge, refine, judge again."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imop.geometry import se3
from imop.geometry.cloud import PointCloud, farthest_points
from imop.geometry.neighbours import within
from imop.policy.contacts import SAME
from imop.policy.evidence import Judge, Surface, Template
from imop.policy.hypotheses import distinct
from imop.policy.matcher import Hypothesis, Scene
from imop.policy.refine import FINEST, Refiner, upright
from imop.policy.region import Region
from imop.types import FloatArray

# Things do not lean: a motion that tilts by this angle (radians) or more is as unlikely as any other tilt.
TILTED = 0.17
# Motions nearer to each other than this, metres and radians, are judged once.
SAME_MOTION = (0.001, 0.01)
# Farther off (metres) than this is another place.
ELSEWHERE = 0.03


@dataclass(frozen=True)
class SearchConfig:
    """How thoroughly to search, and what is preferred among equally good explanations.

    Attributes:
        refined: how many seeds are refined by closest points.
        finished: how many of the refined motions get the finest stage too.
        righted: how many of the best are set upright, too.
        turned: how many of the best are tried half a turn off, too: long things have two ends.
        turn: share of its score that a hypothesis loses for half a turn off the demonstrated motion.
        tilt: share that it loses for tilting things by `TILTED` or more.
        change: share that it loses for another place than the demonstrated motion leads to.
    """

    refined: int = 12
    finished: int = 4
    righted: int = 12
    turned: int = 0
    turn: float = 0.03
    tilt: float = 0.35
    change: float = 0.12


class Search:
    """Searches the region of one demonstrated step in observed scenes.

    Args:
        config: how.
        before: the demonstrated scene.
        region: of the step, in that scene.
    """

    def __init__(self, config: SearchConfig, before: Scene, region: Region) -> None:
        self._config, self._region = config, region
        self._template = Template(region, before.observation.views)
        self._center = region.cloud.points.mean(axis=0)
        self._T_world_gripper = before.observation.T_world_gripper
        self._coarse = [region.cloud.points[farthest_points(region.cloud.points, 400)]]
        if region.context is not None:
            # A thin part slides along itself; what it is fixed to holds it.
            self._coarse.append(region.whole.points[farthest_points(region.whole.points, 600)])
        self._fine = region.cloud.points[farthest_points(region.cloud.points, 1500)]

    def without_held(self, query: Scene, cloud: PointCloud) -> PointCloud:
        """The part of a query's cloud that is not in the hand, if the region is not what is held."""
        if not len(self._region.p_gripper_held):
            return cloud
        p_held = se3.apply(query.observation.T_world_gripper, self._region.p_gripper_held)
        return cloud.select(~within(cloud.points, p_held, SAME))

    def __call__(
        self, query: Scene, things: PointCloud, seeds: FloatArray, hints: Sequence[FloatArray]
    ) -> tuple[Hypothesis, ...]:
        """Where the region is in the query, best first.

        Args:
            query: the observed scene.
            things: at least 5 points of it, all that the region may be.
            seeds: (H, 4, 4) motions to begin with.
            hints: motions (4, 4) that are tried in any case.
        """
        judge = Judge(self._template, Surface(things, query.observation.views))
        T_repeated = query.observation.T_world_gripper @ se3.invert(self._T_world_gripper)
        likely = np.stack([*hints, np.eye(4), T_repeated])
        order = np.argsort(-judge.glance(seeds), kind="stable")
        chosen = distinct(seeds[order], self._center, keep=self._config.refined)
        motions = self._refined(things, judge, likely, seeds[order[chosen]])
        preference = [self._preference(hypothesis, T_repeated, bool(hints)) for hypothesis in motions]
        best_first = [motions[i] for i in np.argsort(-np.asarray(preference), kind="stable")]
        different = distinct(np.stack([h.T_query_support for h in best_first]), self._center, len(best_first))
        return tuple(best_first[i] for i in different)

    def _refined(
        self, things: PointCloud, judge: Judge, likely: FloatArray, seeds: FloatArray
    ) -> list[Hypothesis]:
        """The likely motions as they are, all motions refined, and all of these set upright."""
        refine = Refiner(things.points)
        found = [judge.judge(T) for T in likely]
        found += [judge.judge(refine(part, T)) for part in self._coarse for T in [*likely, *seeds]]
        found.sort(key=lambda hypothesis: -hypothesis.score)
        ends = [self._half_turn(h.T_query_support) for h in found[: self._config.turned]]
        found += [judge.judge(refine(part, T)) for part in self._coarse for T in ends]
        found.sort(key=lambda hypothesis: -hypothesis.score)
        # Many seeds end in the same place.
        motions = np.stack([hypothesis.T_query_support for hypothesis in found])
        found = [found[i] for i in distinct(motions, self._center, len(found), *SAME_MOTION)]
        # The last half millimetre is worth looking for only where it matters.
        finished = [refine(self._fine, h.T_query_support, FINEST) for h in found[: self._config.finished]]
        found += [judge.judge(T) for T in finished]
        found.sort(key=lambda hypothesis: -hypothesis.score)
        best = found[: self._config.righted]
        return found + [judge.judge(upright(h.T_query_support, self._center)) for h in best]

    def _half_turn(self, T: FloatArray) -> FloatArray:
        """The motion, then half a turn about the vertical through the middle of what it moved."""
        p = se3.apply(T, middle(self._coarse[-1])[None])[0]
        R = se3.euler(z=np.pi)
        return se3.make(R, p - R @ p) @ T

    def _preference(self, hypothesis: Hypothesis, T_repeated: FloatArray, begun: bool) -> float:
        """The score, less for moving otherwise than demonstrated and for tilting what stands on a table.

        Symmetric things have many equal explanations; the one that repeats the demonstrated motion of the
        gripper from where it is now (`T_repeated`) is the easiest to reach and does not twist what is held.
        Among equal things, the one that was approached (if the episode has `begun`) stays the aim.
        """
        T, cost = hypothesis.T_query_support, self._config
        turn = float(se3.rotation_distance(T, T_repeated)) / np.pi
        tilt = min(float(np.arccos(np.clip(T[2, 2], -1.0, 1.0))) / TILTED, 1.0)
        p_moved, p_repeated = se3.apply(np.stack([T, T_repeated]), self._center[None])[:, 0]
        away = min(float(np.linalg.norm(p_moved - p_repeated)) / ELSEWHERE, 1.0) if begun else 0.0
        return hypothesis.score * (1 - cost.turn * turn - cost.tilt * tilt - cost.change * away)


def upright_motions(center: FloatArray, places: FloatArray, turns: int) -> FloatArray:
    """(P * turns, 4, 4) motions that carry `center` (3,) to places (P, 3), in all upright turns."""
    yaw = np.linspace(0.0, 2 * np.pi, turns, endpoint=False)
    R = np.tile(np.stack([se3.euler(z=float(angle)) for angle in yaw]), (len(places), 1, 1))
    return se3.make(R, np.repeat(places, turns, axis=0) - R @ center)


def middle(points: FloatArray) -> FloatArray:
    """Centre of the bounding box: which side was seen shifts it less than the mean."""
    center: FloatArray = (points.min(axis=0) + points.max(axis=0)) / 2
    return center
