"""One search in one scene: from many guesses where a region went to few that explain what is seen."""

from collections.abc import Callable, Sequence

import numpy as np

from imop.geometry import se3
from imop.geometry.icp import CLOSE, FINEST, NEARBY, upright
from imop.geometry.ransac import distinct
from imop.policy.evidence import Judge
from imop.policy.matcher import Hypothesis
from imop.policy.search import Search, straightened, upright_motions
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
STILL = 0.65
# One that has moved as before is explained by this score at least, and as well as anything that is sure but
# for what the cameras cannot see of it, for the hand is before it. Of what has bent they see that it is gone.
MOSTLY = 0.55
# Turns in which what is bent is tried, how much of its score one loses for half a turn, and the share of the
# best that is not worth bending for.
TURNS, BENDING, NEARLY = 24, 0.1, 0.9
# Not mended yet, a motion is worth a try that explains this share of what the best does.
TURNABLE = 0.5


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
        likely = self._unrivalled(trusted, STILL * self._config.sure)
        if not likely:
            return ()
        hint, straight = likely
        T = self._settled(hint, CLOSE)
        near = np.stack([T, upright(T, self._center), straight])
        different = near[distinct(near, self._center, len(near), *SAME_MOTION)]
        ordered = self._ordered([self._judge.judge(T) for T in different])
        best, sure = ordered[0], self._config.sure
        if best.score >= sure:
            return ordered
        seen = best.score >= MOSTLY and self._judge.in_view(best.T_query_support) >= sure
        return ordered if seen else ()

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
        near = [T, *(self._moved(other) for other in self._promising(others, TURNABLE))]
        near += [upright(T, self._center) for T in near]
        found = self._judged(self._promising(near, RIVAL))
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

    def kept(self, found: tuple[Hypothesis, ...]) -> tuple[Hypothesis, ...]:
        """What was found, or the motion begun if it leads there and explains the scene about as well."""
        repeated = self.finished(self._T_repeated)
        there = self._near(repeated.T_query_support[None], found[0].T_query_support)[0]
        if self._begun and there and repeated.score >= RIVAL * found[0].score:
            return (repeated, *found)
        return found

    def bent(self, found: tuple[Hypothesis, ...], center: FloatArray) -> tuple[Hypothesis, ...]:
        """What was found, or what explains the scene better in another turn about a point (3,) of the region.

        What bends ends about where it would if it did not, but in another direction.
        """
        T = found[0].T_query_support
        p_there = se3.apply(T, center[None])
        settled = [self._settled(turn @ T, NEARBY) for turn in upright_motions(p_there[0], p_there, TURNS)]
        ends = np.stack([end for motion in settled for end in (motion, upright(motion, self._center))])
        ends = ends[self._near(ends, T, center)]
        if not len(ends):
            return found
        judged = self._judged(list(ends))
        turned = se3.rotation_distance(np.stack([h.T_query_support for h in judged]), T)
        best = judged[int(np.argmax([h.score for h in judged] - BENDING * turned / np.pi))]
        if self.finished(T).score >= NEARLY * best.score:
            return found
        return self.kept((best, *found))

    def repeated(self) -> tuple[Hypothesis, ...]:
        """The demonstrated motion of the gripper as the only hypothesis."""
        return (self._judge.judge(self._T_repeated),)

    def slipped(self) -> Hypothesis:
        """Where the gripper has taken the region, but for a slip in the hand."""
        return self.finished(self._moved(self._T_repeated))

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

    def _settled(self, T: FloatArray, stages: tuple[float, ...]) -> FloatArray:
        """The motion next to `T`, which is as near already as the first of the stages."""
        T = self.things.refine(self._search.coarse[-1], T, stages)
        return self.things.refine(self._search.fine, T, FINEST)

    def _moved(self, T: FloatArray, part: int = -1) -> FloatArray:
        return self.things.refine(self._search.coarse[part], T)

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
        return straightened(T, self._T_repeated, middle(self._search.coarse[-1]))

    def _near(self, motions: FloatArray, T: FloatArray, center: FloatArray | None = None) -> BoolArray:
        """(H,) which motions carry a point (3,), by default the region's middle, about where `T` does."""
        here = (self._center if center is None else center)[None]
        p_moved, p = se3.apply(motions, here)[:, 0], se3.apply(T, here)[0]
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
