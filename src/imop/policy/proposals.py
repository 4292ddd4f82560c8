"""Where the region may have gone: motions that are worth a look, by the generators that propose them.

| generator | proposes |
|---|---|
| `hint` | the motion of the step before |
| `gripper` | what the gripper has done since the demonstration, for what it holds |
| `fit` | what most matches agree on, by least squares over all points of the region |
| `firm` | the same, weighted by how little each point may differ |
| `matches` | what some matches agree on, by sampled triples, and every turn where most of them lead |
| `upright` | what was found, set upright |
| `anywhere` | every turn on every thing |
| `turn` | what was found, in those turns that leave the shape as it is and fit its paint best |
| `half_turn` | half a turn after what was found |
| `straight` | what was found, turned as the gripper was in the demonstration |
| `exact` | what was found, laid exactly onto what was seen |
| `goal` | every turn on every thing, for what stands where the hand goes |
| `part`, `payload` | the same as `matches` for what is next to the gripper, and for what it takes next |
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imop.geometry import se3
from imop.geometry.cloud import middle
from imop.geometry.neighbours import nearest, within
from imop.geometry.ransac import agreement, sample_motions
from imop.geometry.turns import peak, turn_about, upright_motions
from imop.policy.contacts import SAME
from imop.policy.evidence import Template, looks
from imop.policy.interfaces import PolicyConfig
from imop.policy.target import Surface, Target
from imop.types import FloatArray

# Share of the matches that must lead to a thing for the region to be set upright on it.
SOME = 0.1
# Motions that take the region to about one place, about as upright, turn it: metres and cosine. Turns whose
# looks differ by no more than this look the same. Both were chosen on close_jar, seeds 10 to 19.
PLACE, ALIKE = (0.02, 0.97), 0.01
# The fine turns that belong to one peak, and how far off the turn of a motion usually is, radians. Both were
# chosen on close_jar, seeds 10 to 29.
NEAR, OFF = np.arange(-4, 5), 0.35


@dataclass(frozen=True, eq=False)
class Matches:
    """Pairs of points, such as the paper's C; several may share the one of the region.

    Attributes:
        x: (K, 3) points of the region, metres.
        n_x: (K, 3) their normals.
        y: (K, 3) points of the query, metres.
        n_y: (K, 3) their normals.
        weight: (K,) how likely they belong together.
    """

    x: FloatArray
    n_x: FloatArray
    y: FloatArray
    n_y: FloatArray
    weight: FloatArray

    def of(self, points: FloatArray) -> "Matches":
        """Those of what is around points (N, 3) of the region."""
        kept = within(self.x, points, SAME)
        return Matches(*(values[kept] for values in (self.x, self.n_x, self.y, self.n_y, self.weight)))

    def agreement(self, T: FloatArray, tolerance: float) -> FloatArray:
        """(H,) share of the matches that each motion (H, 4, 4) carries nearer than `tolerance`, metres."""
        return agreement(T, self.x, self.y, self.weight, tolerance)

    def motions(self, samples: int) -> FloatArray:
        """(H, 4, 4) motions that some matches agree on, from so many triples of them."""
        if not len(self.x):
            return np.zeros((0, 4, 4))
        return sample_motions(self.x, self.y, self.n_x, self.n_y, self.weight, samples=samples)

    def upright(self, target: Target, places: int, turns: int, middles: Sequence[FloatArray]) -> FloatArray:
        """(H, 4, 4) motions, in every turn, to the things that most of the region was matched to.

        Matches tell where a thing is more easily than how it is turned.

        Args:
            target: of the query.
            places: how many things at most.
            turns: how often, over a full turn.
            middles: points (3,) of the region that may come to the middle of the thing.
        """
        seeds = [np.zeros((0, 4, 4))]
        if not len(self.x):
            return seeds[0]
        points, labels = target.cloud.points, target.labels
        thing = labels[nearest(self.y, points)[1][:, 0]]
        weights = np.bincount(thing, weights=self.weight, minlength=labels.max() + 1)
        for label in np.argsort(-weights)[:places]:
            w = self.weight * (thing == label)
            if w.sum() > SOME * self.weight.sum():
                x, y = (np.average(points, axis=0, weights=w) for points in (self.x, self.y))
                seeds.append(upright_motions(x, y[None], turns))
                place = middle(points[labels == label])[None]
                seeds += [upright_motions(center, place, turns) for center in middles]
        return np.concatenate(seeds)


@dataclass(frozen=True, eq=False)
class Asked:
    """What a matcher says about one scene.

    Attributes:
        fits: generator -> (4, 4) motion that it proposes before all others.
        matches: pairs of points.
    """

    fits: dict[str, FloatArray]
    matches: Matches


def straightened(T: FloatArray, T_straight: FloatArray, p: FloatArray) -> FloatArray:
    """(4, 4) the motion `T_straight`, carried on to where `T` takes a point (3,)."""
    carried = T_straight.copy()
    carried[:3, 3] += (se3.apply(T, p[None]) - se3.apply(T_straight, p[None]))[0]
    return carried


class Turns:
    """Which turn of a region is meant: how shape, colours and their pattern lie in each, among all turns.

    A faint mark tells little about where the region is, but much about its turn. Closest points tell nothing
    about the turn of something round.

    Args:
        template: of the region.
        surface: what was observed.
        axis: (3,) a point of its axis, if it is round.
        half: (4, 4) the turn that it may be mistaken in, if it is not.
        config: how many turns are looked at.
    """

    def __init__(
        self,
        template: Template,
        surface: Surface,
        axis: FloatArray | None,
        half: FloatArray,
        config: PolicyConfig,
    ) -> None:
        self._template, self._surface, self._axis, self._config = template, surface, axis, config
        self._some = np.stack([np.eye(4), half]) if axis is None else _about(axis, config.among)
        self._places: list[tuple[FloatArray, FloatArray]] = []

    def stand_out(self, T: FloatArray) -> FloatArray:
        """(H, 3) how far looks of motions (H, 4, 4) are above those of all turns, in standard deviations."""
        usual = np.stack([self._usual(motion) for motion in T])
        return _deviations(self._looks(T), usual[:, 0], usual[:, 1])

    def best(self, T: FloatArray) -> list[FloatArray]:
        """The turns of a motion (4, 4) of something round that fit best, likeliest first."""
        if self._axis is None:
            return []
        angles, fits = self._fits(T)
        beside = np.stack([np.roll(fits, k) for k in (-2, -1, 1, 2)])
        peaks = np.flatnonzero(fits >= beside.max(axis=0))
        best = peaks[np.argsort(-fits[peaks], kind="stable")][: self._config.tried]
        return [self._turned(T, _peak(angles, fits, k)) for k in best]

    def nearby(self, T: FloatArray) -> FloatArray:
        """The turn of a motion (4, 4) of something round that fits best among those nearby."""
        if self._axis is None:
            return T
        angles, fits = self._fits(T)
        likely = fits - 0.5 * (np.minimum(angles, 2 * np.pi - angles) / OFF) ** 2
        return self._turned(T, _peak(angles, likely, NEAR[likely[NEAR].argmax()]))

    def kept(self, T: FloatArray, T_laid: FloatArray) -> FloatArray:
        """The motion `T_laid` (4, 4) next to `T`, turned as `T` is."""
        if self._axis is None:
            return T_laid
        return self._turned(T_laid, -se3.yaw(se3.invert(T) @ T_laid))

    def _fits(self, T: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(N,) angles, and how well something round fits after a motion (4, 4) and each of them."""
        assert self._axis is not None
        values = self._looks(T @ _about(self._axis, self._config.painted))
        angles = np.linspace(0.0, 2 * np.pi, len(values), endpoint=False)
        return angles, _deviations(values, values.mean(axis=0), values.std(axis=0)).sum(axis=1)

    def _turned(self, T: FloatArray, angle: float) -> FloatArray:
        assert self._axis is not None
        return np.asarray(T @ turn_about(self._axis, angle))

    def _looks(self, T: FloatArray) -> FloatArray:
        return looks(self._template, self._surface, T)

    def _usual(self, T: FloatArray) -> FloatArray:
        """(2, 3) mean and standard deviation of the looks of all turns of a motion (4, 4)."""
        place = np.append(se3.apply(T, self._template.center[None])[0], T[:3, 2])
        for known, usual in self._places:
            if np.linalg.norm(place[:3] - known[:3]) < PLACE[0] and place[3:] @ known[3:] > PLACE[1]:
                return usual
        values = self._looks(T @ self._some)
        usual = np.stack([values.mean(axis=0), values.std(axis=0)])
        if self._axis is not None:
            self._places.append((place, usual))
        return usual


def _about(axis: FloatArray, count: int) -> FloatArray:
    """(count, 4, 4) turns about the vertical through `axis` (3,)."""
    return upright_motions(axis, axis[None], count)


def _peak(angles: FloatArray, fits: FloatArray, k: int) -> float:
    """The angle at which `fits` (N,) at `angles` (N,) of a full turn are highest next to the k-th."""
    return float(angles[k] + peak(NEAR * angles[1], fits[(k + NEAR) % len(fits)]))


def _deviations(values: FloatArray, mean: FloatArray, deviation: FloatArray) -> FloatArray:
    return np.asarray((values - mean) / (deviation + ALIKE))
