"""Candidates of one step in one scene: refined, judged by evidence, and ranked by their probability."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from imop.candidates.evidence import Surface, Template, glance, shares
from imop.candidates.verification import Verifier
from imop.geometry import se3
from imop.geometry.cloud import PointCloud
from imop.geometry.icp import CLOSE, FINEST
from imop.geometry.ransac import distinct
from imop.policy.matcher import Hypothesis, Scene, Transition
from imop.policy.matches import Matches
from imop.policy.region import Region
from imop.policy.things import Standing
from imop.types import FloatArray


@dataclass(frozen=True)
class PolicyConfig:
    """All that is set by hand in the policy beside the constants of geometry.

    Attributes:
        enough: probability of a candidate from which no further generator is asked.
        threshold: least probability of a region point.
        refined: seeds of one part of the region that are refined by closest points.
        judged: refined motions of one stage that are judged.
        tried: how many of the best are also tried in their half turn, straight, and upright.
        candidates: query points per region point that may be matched.
        tight, loose: matches nearer than this to where a motion carries them speak for it, metres.
        next_to: what of the region is this near to where the gripper goes is a part of its own, metres.
        same_motion: motions nearer to each other than this, metres and radians, are judged once.
        fewest: a thing of fewer points is none.
    """

    enough: float = 0.9
    threshold: float = 0.5
    refined: int = 8
    judged: int = 12
    tried: int = 3
    candidates: int = 2
    tight: float = 0.015
    loose: float = 0.03
    next_to: float = 0.05
    same_motion: tuple[float, float] = (0.002, 0.02)
    fewest: int = 30


class Target(Standing):
    """What of an observed scene the region may be, prepared once.

    Attributes:
        surface: the points as evidence.
    """

    def __init__(self, query: Scene, cloud: PointCloud) -> None:
        super().__init__(query, cloud)
        self.surface = Surface(self.cloud, tuple(query.observation.views.values()))


@dataclass(frozen=True, eq=False)
class Asked:
    """What a matcher says about one scene.

    Attributes:
        fits: generator -> (4, 4) motion that it proposes before all others.
        matches: pairs of points.
    """

    fits: dict[str, FloatArray]
    matches: Matches


@dataclass(frozen=True, eq=False)
class Part:
    """Some points of the region that are looked for on their own.

    Attributes:
        name: of the generator.
        column: of `evidence.glance` that its seeds are chosen by.
        coarse, fine: (K, 3) points that are laid onto the scene, first and last.
    """

    name: str
    column: int
    coarse: FloatArray
    fine: FloatArray


@dataclass(frozen=True, eq=False)
class Sought:
    """A demonstrated step as it is looked for in any scene.

    Attributes:
        config: how thoroughly.
        step: the demonstrated one.
        region: of it.
        template: the same, ready to be compared.
        parts: of the region: all of it, what stays in place, then what else is looked for on its own.
        turns: (S, 4, 4) after which the region looks the same.
        verifier: gives probabilities.
    """

    config: PolicyConfig
    step: Transition
    region: Region
    template: Template
    parts: tuple[Part, ...]
    turns: FloatArray
    verifier: Verifier

    @property
    def T_goal(self) -> FloatArray:
        """(4, 4) the demonstrated action pose T_i."""
        return self.step.action.T_world_gripper

    @cached_property
    def center(self) -> FloatArray:
        """(3,) of the region."""
        return np.asarray(self.region.cloud.points.mean(axis=0))


class Pool:
    """Candidates of one step in one scene."""

    def __init__(
        self,
        sought: Sought,
        target: Target,
        hints: Sequence[FloatArray],
        T_repeated: FloatArray,
        asked: Asked | None,
    ) -> None:
        self._sought, self.target, self.hints = sought, target, hints
        self.T_repeated, self.asked = T_repeated, asked
        self.motions: list[FloatArray] = []
        self.generators: list[str] = []
        self._rows: list[FloatArray] = []

    def moved(self, part: Part, T: FloatArray) -> FloatArray:
        """The motion (4, 4) near `T` that lays a part of the region onto the scene, about."""
        return self.target.refine(part.coarse, T)

    def finished(self, part: Part, T: FloatArray) -> FloatArray:
        """The same next to `T`, exactly."""
        return self.target.refine(part.fine, self.target.refine(part.coarse, T, CLOSE), FINEST)

    def search(self, part: Part, seeds: FloatArray, name: str = "") -> None:
        """Refine and take in the most promising of seeds (H, 4, 4), in their colours and in any."""
        if not len(seeds):
            return
        config, center = self._sought.config, self._sought.center
        looks = glance(self._sought.template, self.target.surface, seeds)
        chosen = set[int]()
        for column in {0, 1} if part.column == 0 else {part.column}:
            order = np.argsort(-looks[:, column], kind="stable")
            chosen |= {int(order[i]) for i in distinct(seeds[order], center, config.refined)}
        name = name or ("matches" if part.name == "region" else part.name)
        self.add(name, [self.moved(part, seeds[i]) for i in sorted(chosen)])

    def add(self, name: str, motions: Sequence[FloatArray]) -> None:
        """Judge motions that differ from all before; the most promising ones, if there are too many."""
        sought = self._sought
        if not motions:
            return
        new = np.stack(motions)
        looks = glance(sought.template, self.target.surface, new).max(axis=1)
        new = new[np.argsort(-looks, kind="stable")]
        every = np.concatenate([np.stack(self.motions), new]) if self.motions else new
        kept = distinct(every, sought.center, len(every), *sought.config.same_motion)
        known = len(self.motions)
        fresh = [i for i in kept if i >= known][: sought.config.judged]
        if fresh:
            added = every[fresh]
            self._rows.append(self._evidence(added))
            self.motions += list(added)
            self.generators += [name] * len(added)

    def evidence(self) -> FloatArray:
        """(H, |EVIDENCE|) of all candidates."""
        return np.concatenate(self._rows)

    def goals(self) -> FloatArray:
        """(H, 4, 4) where the candidates take the gripper."""
        return np.stack(self.motions) @ self._sought.T_goal

    def probabilities(self) -> FloatArray:
        """(H,) of being right."""
        return self._sought.verifier(self.evidence(), self.goals())

    def best(self, count: int) -> list[FloatArray]:
        """The likeliest motions so far, distinct."""
        order = np.argsort(-self.probabilities(), kind="stable")
        motions = np.stack(self.motions)[order]
        return [motions[i] for i in distinct(motions, self._sought.center, count)]

    def ranked(self) -> tuple[Hypothesis, ...]:
        """All candidates, likeliest first, without those that are about the same as a likelier one."""
        p = self.probabilities()
        order = np.argsort(-p, kind="stable")
        motions = np.stack(self.motions)[order]
        kept = distinct(motions, self._sought.center, len(motions))
        return tuple(self._candidate(int(order[i]), float(p[order[i]])) for i in kept)

    def _candidate(self, i: int, probability: float) -> Hypothesis:
        template, T = self._sought.template, self.motions[i]
        which = np.arange(template.size)
        points, normals = template.moved(T[None], which)
        found = self.target.surface.explain(points, normals, template.hue[which], template.spread[which])
        good = np.flatnonzero(found.loose > 0.3)
        p_query = self.target.cloud.points[found.index[good]]
        p_support = template.cloud.points[good]
        return Hypothesis(T, probability, p_support, p_query, self.generators[i], probability)

    def _evidence(self, T: FloatArray) -> FloatArray:
        """(H, |EVIDENCE|) of motions (H, 4, 4); in the order of `networks.verification.EVIDENCE`."""
        sought = self._sought
        first = shares(sought.template, self.target.surface, T)
        return np.concatenate([first, self._support(T), self._poses(T), self._situation(len(T))], axis=1)

    def _support(self, T: FloatArray) -> FloatArray:
        """(H, 5) what the matches say, in any of the turns of equal shape."""
        if self.asked is None or not len(self.asked.matches.x):
            return np.zeros((len(T), 5))
        sought, m = self._sought, self.asked.matches
        config, turns = sought.config, sought.turns
        near = m.of(sought.parts[2].fine) if len(sought.parts) > 2 else m
        turned = (T[:, None] @ turns).reshape(-1, 4, 4)

        def of(matches: Matches, tolerance: float) -> FloatArray:
            return np.asarray(matches.agreement(turned, tolerance).reshape(len(T), -1).max(axis=1))

        sure = np.full(len(T), m.weight.mean())
        columns = [np.ones(len(T)), sure, of(m, config.tight), of(m, config.loose), of(near, config.loose)]
        return np.stack(columns, axis=1)

    def _poses(self, T: FloatArray) -> FloatArray:
        """(H, 7) tilt, rise, and how far the gripper goes from where hint and repetition take it."""
        T_goal, center = self._sought.T_goal, self._sought.center
        tilt = np.arccos(np.clip(T[:, 2, 2], -1.0, 1.0))
        rise = 10 * (se3.apply(T, center[None])[:, 0, 2] - center[2])
        columns = [tilt, rise, np.full(len(T), float(bool(len(self.hints))))]
        for known in (self.hints[-1:], (self.T_repeated,)):
            goals = T @ T_goal
            other = known[0] @ T_goal if known else None
            away = np.zeros(len(T)) if other is None else se3.translation_distance(goals, other)
            turn = np.zeros(len(T)) if other is None else se3.rotation_distance(goals, other)
            columns += [np.log1p(away / 0.01), turn]
        return np.stack(columns, axis=1)

    def _situation(self, count: int) -> FloatArray:
        """(count, 9) what is the same for all candidates: the hand, and what kind of region it is."""
        sought, step = self._sought, self._sought.step
        region, spread, w = sought.region, sought.template.spread, sought.template.weights
        size = np.ptp(region.cloud.points, axis=0).max()
        opening = self.target.query.observation.gripper_opening
        values = [
            float(len(region.p_gripper_held) > 0),
            float(step.action.gripper_open),
            opening - step.before.observation.gripper_opening,
            10 * size,
            np.log1p(len(region.cloud)) / 5,
            region.weight.mean(),
            *(100 * np.average(spread, weights=w[:, k] + 1e-9) for k in (0, 1)),
            np.log(len(sought.turns)),
        ]
        return np.tile(np.array(values, dtype=np.float64), (count, 1))
