"""From many guesses where a region went to few that explain what is seen: judge, refine, judge again."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from imop.geometry import se3
from imop.geometry.cloud import farthest_points
from imop.geometry.neighbours import nearest
from imop.policy.evidence import Judge, Template
from imop.policy.hypotheses import distinct
from imop.policy.matcher import Hypothesis, Scene
from imop.policy.objects import connected
from imop.policy.refine import CLOSE, FINEST, upright
from imop.policy.region import Region
from imop.policy.symmetry import half_turn
from imop.policy.things import Things, middle
from imop.types import BoolArray, FloatArray

Opinion = Callable[[FloatArray], FloatArray]

# Things do not lean: a motion that tilts by this angle (radians) or more is as unlikely as any other tilt.
TILTED = 0.17
# Motions nearer to each other than this, metres and radians, are judged once.
SAME_MOTION = (0.001, 0.01)
# Farther off (metres) than this is another place.
ELSEWHERE = 0.03
# Turned by this (radians) or more against the demonstrated motion is another motion.
OTHERWISE = 1.0
# Turned by more than this (radians) is not about alike.
TURNED = 0.35
# A likely motion that explains this share of what a trusted one does has to be compared with it.
RIVAL = 0.85
# A thing that has moved as before is explained at a glance by this share of what it is in the end.
STILL = 0.75
# What is farther than this (metres) from where a region may be has nothing to say about it.
BESIDE = 0.08
# Before closest points have mended it, a motion is worth a try that explains this share of what the best does.
TURNABLE = 0.5


@dataclass(frozen=True)
class SearchConfig:
    """How thoroughly to search, and what is preferred among equally good explanations.

    Attributes:
        refined: how many seeds are refined by closest points.
        judged: how many of the refined motions, those that look best at a glance, are judged.
        finished: how many of the refined motions get the finest stage too.
        righted: how many of the best are set upright, too.
        turned: how many of the best are tried half a turn off, too: long things have two ends.
        turn: share of its score that a hypothesis loses for half a turn off the demonstrated motion.
        tilt: share that it loses for tilting things by `TILTED` or more; twice for turning them over.
        change: share that it loses for another pose than the demonstrated motion leads to, once begun.
        sure: score from which a trusted motion needs no search.
        followed: the same of a motion that was right in the step before.
        opinion: what full support by the matcher's opinion adds to the score when motions are compared.
    """

    refined: int = 12
    judged: int = 10
    finished: int = 4
    righted: int = 12
    turned: int = 0
    turn: float = 0.03
    tilt: float = 0.35
    change: float = 0.12
    sure: float = 0.7
    followed: float = 0.6
    opinion: float = 0.1


class Search:
    """Searches the region of one demonstrated step in observed scenes.

    Args:
        config: how.
        before: the demonstrated scene.
        region: of the step, in that scene.
        loose: whether the region is a thing of its own, whatever it touches.
    """

    def __init__(self, config: SearchConfig, before: Scene, region: Region, loose: bool = False) -> None:
        self.config, self.region = config, region
        self.template = Template(region, tuple(before.observation.views.values()))
        self.center = region.cloud.points.mean(axis=0)
        self.T_world_gripper = before.observation.T_world_gripper
        self.coarse = [region.cloud.points[farthest_points(region.cloud.points, 400)]]
        if region.context is not None:
            # A thin part slides along itself; what it is fixed to holds it.
            self.coarse.append(region.whole.points[farthest_points(region.whole.points, 600)])
        self.fine = region.cloud.points[farthest_points(region.cloud.points, 1500)]
        self.half_turn = half_turn(region.cloud.points if loose else self._thing(before))

    def likely(self, query: Scene, hints: Sequence[FloatArray]) -> FloatArray:
        """(H, 4, 4) motions to look at in any case: hints, none at all, and what the gripper has done."""
        return np.stack([*hints, np.eye(4), self.repeated(query)])

    def repeated(self, query: Scene) -> FloatArray:
        """(4, 4) the motion of the gripper since the demonstration."""
        return query.observation.T_world_gripper @ se3.invert(self.T_world_gripper)

    def around(self, points: FloatArray, motions: FloatArray) -> BoolArray:
        """(N,) which points (N, 3) have to do with the region after any of the motions (H, 4, 4)."""
        whole = self.region.whole.points
        corners = np.stack(np.meshgrid(*np.stack([whole.min(axis=0), whole.max(axis=0)]).T), axis=-1)
        reached = np.zeros(len(points), dtype=bool)
        for box in se3.apply(motions, corners.reshape(-1, 3)):
            inside = np.ones(len(points), dtype=bool)
            for column, low, high in zip(points.T, box.min(axis=0), box.max(axis=0), strict=True):
                inside &= (column > low - BESIDE) & (column < high + BESIDE)
            reached |= inside
        return reached

    def _thing(self, before: Scene) -> FloatArray:
        """(N, 3) the thing in the demonstrated scene that the region is part of."""
        points = before.cloud.points[~before.ground.bare]
        if not len(points):
            return self.region.cloud.points
        labels = connected(points)
        part_of = labels[nearest(self.coarse[0], points)[1][:, 0]]
        thing: FloatArray = points[labels == np.bincount(part_of).argmax()]
        return thing


class Inquiry:
    """One search in one observed scene.

    Args:
        search: what is searched, and how.
        things: all that the region may be.
        hints: motions (4, 4) that are tried in any case.
        opinion: the matcher's support, 0 .. 1, of motions (H, 4, 4), beside what the cameras saw.
    """

    def __init__(
        self,
        search: Search,
        things: Things,
        hints: Sequence[FloatArray] = (),
        opinion: Opinion | None = None,
    ) -> None:
        self._search, self._config, self._center = search, search.config, search.center
        self._judge = Judge(search.template, things.surface)
        self.things, self.hints = things, hints
        self._T_repeated = search.repeated(things.query)
        self._likely = search.likely(things.query, hints)
        self._begun, self._opinion = bool(hints), opinion

    def followed(self) -> tuple[Hypothesis, ...]:
        """The motions next to the best hint, or to what the gripper has done since the demonstration.

        None if the episode only begins, or if none of them explains the scene.
        """
        if not self._begun:
            return ()
        trusted = np.stack([*self.hints, self._T_repeated])
        likely = self._unrivalled(trusted, STILL * self._config.followed)
        if not likely:
            return ()
        hint, straight = likely
        T = self.things.refine(self._search.coarse[-1], hint, CLOSE)
        T = self.things.refine(self._search.fine, T, FINEST)
        near = np.stack([T, upright(T, self._center), straight])
        different = near[distinct(near, self._center, len(near), *SAME_MOTION)]
        ordered = self._ordered([self._judge.judge(T) for T in different])
        return ordered if ordered[0].score >= self._config.followed else ()

    def confirmed(self, trusted: FloatArray) -> tuple[Hypothesis, ...]:
        """The motions next to the best of trusted ones (H, 4, 4); none if it does not explain the scene."""
        likely = self._unrivalled(trusted) if len(trusted) else ()
        if not likely:
            return ()
        best, straight = likely
        T = self._moved(best)
        if self._judge.glance(T[None])[0] < 0.5 * self._config.sure:
            return ()
        others = [self._as_repeated(T), straight, *([self._half_turn(T)] * bool(self._config.turned))]
        found = [T, *(self._moved(other) for other in self._promising(others, TURNABLE))]
        found = self._judged(self._promising([*found, *(upright(T, self._center) for T in found)], RIVAL))
        found.append(self.finished(self._ordered(found)[0].T_query_support))
        ordered = self._ordered(found)
        return ordered if ordered[0].score >= self._config.sure else ()

    def _unrivalled(self, trusted: FloatArray, least: float = 0.0) -> tuple[FloatArray, ...]:
        """The best of trusted motions (H, 4, 4), and the straightest that is about as good and there, too.

        Nothing if the best explains less than `least` of the region at a glance, or if another likely motion
        explains the scene about as well, for then all have to be compared.
        """
        motions = np.concatenate([trusted, self._likely])
        glances = self._judge.glance(motions)
        best = int(np.argmax(glances[: len(trusted)]))
        alike = motions[glances >= RIVAL * glances[best]]
        if glances[best] < least or not np.all(self._near(alike, motions[best])):
            return ()
        return motions[best], alike[np.argmin(se3.rotation_distance(alike, self._T_repeated))]

    def search(self, seeds: FloatArray) -> tuple[Hypothesis, ...]:
        """Where the region is in the query, best first.

        Args:
            seeds: (H, 4, 4) motions to begin with.
        """
        seeds = seeds[np.argsort(-self._judge.glance(seeds), kind="stable")]
        seeds = seeds[distinct(seeds, self._center, keep=self._config.refined)]
        starts, parts = [*self._likely, *seeds], range(len(self._search.coarse))
        found = [self._judge.judge(T) for T in self._likely]
        found += self._judged([self._moved(T, part) for part in parts for T in starts])
        ends = [self._half_turn(h.T_query_support) for h in _best(found, self._config.turned)]
        found = _best(found + self._judged([self._moved(T, part) for part in parts for T in ends]))
        # The last half millimetre is worth looking for only where it matters.
        found = _best(found + [self.finished(h.T_query_support) for h in found[: self._config.finished]])
        return self._ordered(
            found + [self._upright(h.T_query_support) for h in found[: self._config.righted]]
        )

    def repeated(self) -> tuple[Hypothesis, ...]:
        """The demonstrated motion of the gripper as the only hypothesis."""
        return (self._judge.judge(self._T_repeated),)

    def alike(self, T: FloatArray, other: FloatArray) -> bool:
        """Whether two motions carry the region to about the same place, turned about alike."""
        return bool(self._near(T[None], other)[0]) and bool(se3.rotation_distance(T, other) < TURNED)

    def _judged(self, motions: list[FloatArray]) -> list[Hypothesis]:
        """The best at a glance of different motions; many seeds end in the same place."""
        if not motions:
            return []
        ranked = np.stack(motions)
        ranked = ranked[np.argsort(-self._judge.glance(ranked), kind="stable")]
        return [
            self._judge.judge(ranked[i])
            for i in distinct(ranked, self._center, self._config.judged, *SAME_MOTION)
        ]

    def _promising(self, motions: list[FloatArray], share: float) -> list[FloatArray]:
        """Those of motions that explain, at a glance, at least so much of what the best of them does."""
        glances = self._judge.glance(np.stack(motions))
        return [T for T, glance in zip(motions, glances, strict=True) if glance >= share * glances.max()]

    def _moved(self, T: FloatArray, part: int = -1) -> FloatArray:
        return self.things.refine(self._search.coarse[part], T)

    def _refined(self, T: FloatArray) -> Hypothesis:
        return self._judge.judge(self._moved(T))

    def finished(self, T: FloatArray) -> Hypothesis:
        """The nearest motion to `T` (4, 4) that lays the region onto what was observed, judged."""
        return self._judge.judge(self.things.refine(self._search.fine, T, FINEST))

    def _upright(self, T: FloatArray) -> Hypothesis:
        return self._judge.judge(upright(T, self._center))

    def _half_turn(self, T: FloatArray) -> FloatArray:
        """The motion after half a turn of the thing that the region is part of."""
        return T @ self._search.half_turn

    def _as_repeated(self, T: FloatArray) -> FloatArray:
        """The demonstrated motion, carried on to the place where `T` leads to."""
        p = middle(self._search.coarse[-1])[None]
        T_repeated = self._T_repeated.copy()
        T_repeated[:3, 3] += (se3.apply(T, p) - se3.apply(T_repeated, p))[0]
        return T_repeated

    def _near(self, motions: FloatArray, T: FloatArray) -> BoolArray:
        """(H,) which motions carry the region about where `T` does."""
        p_moved, p = se3.apply(motions, self._center[None])[:, 0], se3.apply(T, self._center[None])[0]
        near: BoolArray = np.linalg.norm(p_moved - p, axis=1) < ELSEWHERE
        return near

    def _ordered(self, found: list[Hypothesis]) -> tuple[Hypothesis, ...]:
        """The different ones among hypotheses, preferred first."""
        preference = np.array([self._preference(hypothesis) for hypothesis in found])
        motions = np.stack([hypothesis.T_query_support for hypothesis in found])
        preference += self._config.opinion * self._supported(motions)
        order = np.argsort(-preference, kind="stable")
        return tuple(found[order[i]] for i in distinct(motions[order], self._center, len(found)))

    def _supported(self, motions: FloatArray) -> FloatArray:
        """(H,) the matcher's support of motions, 1 for the best; a half turn on, things have the same.

        Networks match the left lever to the right one with full confidence: between these only what was seen
        decides.
        """
        if self._opinion is None:
            return np.zeros(len(motions))
        both = np.stack([motions, motions @ self._search.half_turn])
        support = self._opinion(both.reshape(-1, 4, 4)).reshape(2, -1).max(axis=0)
        return np.asarray(support / max(support.max(), 1e-9))

    def _preference(self, hypothesis: Hypothesis) -> float:
        """The score, less for moving otherwise than demonstrated and for tilting what stands on a table.

        Symmetric things have many equal explanations; the one that repeats the demonstrated motion of the
        gripper from where it is now (`T_repeated`) is the easiest to reach and does not twist what is held.
        Among equal things, the one that was approached (if the episode has begun) stays the aim.
        """
        T, cost = hypothesis.T_query_support, self._config
        turn = float(se3.rotation_distance(T, self._T_repeated)) / np.pi
        tilt = min(float(np.arccos(np.clip(T[2, 2], -1.0, 1.0))) / TILTED, 1.0) + float(T[2, 2] < 0)
        p_moved, p_repeated = se3.apply(np.stack([T, self._T_repeated]), self._center[None])[:, 0]
        away = max(float(np.linalg.norm(p_moved - p_repeated)) / ELSEWHERE, turn * np.pi / OTHERWISE)
        away = min(away, 1.0) if self._begun else 0.0
        return hypothesis.score * (1 - cost.turn * turn - cost.tilt * tilt - cost.change * away)


def _best(found: list[Hypothesis], count: int | None = None) -> list[Hypothesis]:
    return sorted(found, key=lambda hypothesis: -hypothesis.score)[:count]


def upright_motions(center: FloatArray, places: FloatArray, turns: int) -> FloatArray:
    """(P * turns, 4, 4) motions that carry `center` (3,) to places (P, 3), in all upright turns."""
    yaw = np.linspace(0.0, 2 * np.pi, turns, endpoint=False)
    R = np.tile(np.stack([se3.euler(z=float(angle)) for angle in yaw]), (len(places), 1, 1))
    return se3.make(R, np.repeat(places, turns, axis=0) - R @ center)
