"""Candidates of one step in one scene: refined, verified by evidence, and ranked by their probability.

The verification network turns the evidence of each candidate and of its rivals into probabilities
(`networks/verification.py`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch

from imop.geometry import se3
from imop.geometry.icp import CLOSE, FINEST
from imop.geometry.ransac import distinct
from imop.networks.verification import VerificationNetwork
from imop.policy.evidence import Template, crowd, glance, palette, shares
from imop.policy.interfaces import Candidate, PolicyConfig, Transition, Tried
from imop.policy.proposals import Asked, Matches, Turns
from imop.policy.region import Region
from imop.policy.target import REACH, Target, obstacles
from imop.types import BoolArray, FloatArray

# Candidates that take the gripper farther apart than this, metres and radians, are rivals.
ELSEWHERE = (0.02, 0.26)
# Who takes the gripper nearer than this to where it was in vain, metres and radians, tries the same again.
# Not tuned: what a grasp of something of a few centimetres forgives.
SAME_TRY = (0.02, np.radians(10.0))
# A point that is explained by more than this has a counterpart.
FOUND = 0.3


class Verifier:
    """Probabilities of candidates, all of one step in one scene."""

    def __init__(self, network: VerificationNetwork) -> None:
        self._network = network

    def __call__(self, evidence: FloatArray, goals: FloatArray) -> FloatArray:
        """(H,) probabilities of being right.

        Args:
            evidence: (H, |EVIDENCE|).
            goals: (H, 4, 4) where the candidates take the gripper.
        """
        known = torch.from_numpy(evidence.astype(np.float32))
        p = self._network.probability(known, torch.from_numpy(rivals(goals)))
        return np.asarray(p.double().numpy())


def rivals(goals: FloatArray) -> BoolArray:
    """(H, H) True where two poses (H, 4, 4) of the gripper are not about the same."""
    return ~se3.near(goals[:, None], goals[None], *ELSEWHERE)


@dataclass(frozen=True, eq=False)
class Part:
    """Some points of the region that are looked for on their own.

    Attributes:
        name: of the generator.
        column: of `evidence.glance` that its seeds are chosen by.
        coarse, fine: (K, 3) points that are laid onto the scene, first and last.
        middles: points (3,) of it that may come to the middle of a thing.
    """

    name: str
    column: int
    coarse: FloatArray
    fine: FloatArray
    middles: tuple[FloatArray, ...]


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
        axis: (3,) a point of the axis of a round region, or None.
        half: (4, 4) half a turn, in which the region may be taken for itself.
        verifier: gives probabilities.
    """

    config: PolicyConfig
    step: Transition
    region: Region
    template: Template
    parts: tuple[Part, ...]
    turns: FloatArray
    axis: FloatArray | None
    half: FloatArray
    verifier: Verifier

    @property
    def T_goal(self) -> FloatArray:
        """(4, 4) the demonstrated action pose T_i."""
        return self.step.action.T_world_gripper

    @property
    def center(self) -> FloatArray:
        """(3,) of the region."""
        return self.template.center

    @cached_property
    def crowd(self) -> FloatArray:
        """(3,) of the demonstrated action, see `evidence.crowd`."""
        before = self.step.before
        standing = before.fused.points[obstacles(before, self.region)]
        return np.asarray(crowd(standing, self.T_goal[None])[0])


class Pool:
    """Candidates of one step in one scene.

    Args:
        sought: the step.
        target: what of the scene the region may be.
        obstacles: (N, 3) all that stands in the scene, but for what is in the hand.
        T_last: (4, 4) the motion of the step before, if there was one.
        T_repeated: (4, 4) what the gripper has done since the demonstration.
        asked: what the matcher says, once it is asked.
    """

    def __init__(
        self,
        sought: Sought,
        target: Target,
        obstacles: FloatArray,
        T_last: FloatArray | None,
        T_repeated: FloatArray,
        asked: Asked | None,
    ) -> None:
        self._sought, self.target, self.T_last = sought, target, T_last
        self.T_repeated, self.asked = T_repeated, asked
        self.turns = Turns(sought.template, target.surface, sought.axis, sought.half, sought.config)
        self._palette = palette(sought.template, target.surface)
        self._obstacles = obstacles
        self.motions: list[FloatArray] = []
        self.generators: list[str] = []
        self._rows: list[FloatArray] = []
        self._probabilities = np.zeros(0)

    def moved(self, part: Part, T: FloatArray) -> FloatArray:
        """The motion (4, 4) near `T` that lays a part of the region onto the scene, about."""
        return self.target.refine(part.coarse, T)

    def finished(self, part: Part, T: FloatArray) -> FloatArray:
        """The same next to `T`, exactly."""
        return self.target.refine(part.fine, self.target.refine(part.coarse, T, CLOSE), FINEST)

    def settled(self, candidate: Candidate) -> Candidate:
        """The same in the best turn nearby, if closest points could not know it; what goes on is settled."""
        if candidate.generator in ("hint", "gripper"):
            return candidate
        return replace(candidate, T_query_support=self.turns.nearby(candidate.T_query_support))

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
        asked = motions and name not in sought.config.without
        new = np.stack(motions) if asked else np.zeros((0, 4, 4))
        if len(new) and self.target.query.focus is not None:
            new = self._in_focus(new)
        if not len(new):
            return
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

    def _in_focus(self, T: FloatArray) -> FloatArray:
        """Those of motions (H, 4, 4) that act on what is meant."""
        template = self._sought.template
        near, which = template.weights[: template.size, 1], np.arange(template.size)
        # Another thing may be smaller than the one that was shown.
        inside = self.target.query.focused(template.moved(T, which)[0], REACH)
        share = inside.reshape(len(T), -1) @ near / near.sum()
        return np.asarray(T[share >= self._sought.config.focused])

    def evidence(self) -> FloatArray:
        """(H, |EVIDENCE|) of all candidates."""
        return np.concatenate(self._rows)

    def goals(self) -> FloatArray:
        """(H, 4, 4) where the candidates take the gripper."""
        return np.stack(self.motions) @ self._sought.T_goal

    def probabilities(self) -> FloatArray:
        """(H,) of being right."""
        if len(self._probabilities) < len(self.motions):
            self._probabilities = self._sought.verifier(self.evidence(), self.goals())
        return self._probabilities

    def best(self, count: int) -> list[FloatArray]:
        """The likeliest motions so far, distinct; fewer than `count` if there are fewer."""
        if not self.motions:
            return []
        order = np.argsort(-self.probabilities(), kind="stable")
        motions = np.stack(self.motions)[order]
        return [motions[i] for i in distinct(motions, self._sought.center, count)]

    def ranked(self, tried: Sequence[Tried] = ()) -> tuple[Candidate, ...]:
        """All candidates, likeliest first, without those that are about the same as a likelier one.

        Args:
            tried: poses that came to nothing; what leads there is less likely to be right.
        """
        if not self.motions:
            return ()
        p = self.probabilities()
        for one in tried:
            again = se3.near(self.goals(), one.T_world_gripper, *SAME_TRY)
            p = np.where(again, p * one.luck / (p * one.luck + 1.0 - p + 1e-12), p)
        order = np.argsort(-p, kind="stable")
        motions = np.stack(self.motions)[order]
        kept = distinct(motions, self._sought.center, len(motions))
        likeliest = [int(order[i]) for i in kept]
        return tuple(Candidate(self.motions[i], float(p[i]), generator=self.generators[i]) for i in likeliest)

    def explained(self, candidate: Candidate) -> Candidate:
        """The same with the points of the region that found a counterpart."""
        template, which = self._sought.template, np.arange(self._sought.template.size)
        points, normals = template.moved(candidate.T_query_support[None], which)
        found = self.target.surface.explain(points, normals, template.hue[which], template.spread[which])
        good = np.flatnonzero(found.loose > FOUND)
        p_query = self.target.cloud.points[found.index[good]]
        return replace(candidate, p_support=template.cloud.points[good], p_query=p_query)

    def _evidence(self, T: FloatArray) -> FloatArray:
        """(H, |EVIDENCE|) of motions (H, 4, 4); in the order of `networks.verification.EVIDENCE`."""
        sought = self._sought
        first = shares(sought.template, self.target.surface, T)
        others = self._support(T), self._poses(T), self._situation(len(T))
        # More in the hand's way than was shown.
        crowded = crowd(self._obstacles, T @ sought.T_goal) - sought.crowd
        return np.concatenate([first, *others, crowded, self.turns.stand_out(T)], axis=1)

    def _support(self, T: FloatArray) -> FloatArray:
        """(H, 5) what the matches say, in any of the turns of equal shape."""
        if self.asked is None or not len(self.asked.matches.x):
            return np.zeros((len(T), 5))
        sought, m = self._sought, self.asked.matches
        config, turns = sought.config, sought.turns
        close = [part for part in sought.parts if part.name in ("part", "payload")]
        near = m.of(close[0].fine) if close else m
        turned = (T[:, None] @ turns).reshape(-1, 4, 4)

        def of(matches: Matches, tolerance: float) -> FloatArray:
            return np.asarray(matches.agreement(turned, tolerance).reshape(len(T), -1).max(axis=1))

        sure = np.full(len(T), m.weight.mean())
        columns = [np.ones(len(T)), sure, of(m, config.tight), of(m, config.loose), of(near, config.loose)]
        return np.stack(columns, axis=1)

    def _poses(self, T: FloatArray) -> FloatArray:
        """(H, 7) tilt, rise, and how far the gripper goes from where hint and repetition take it.

        At the beginning the hand stands where it stood in the demonstration, whatever lies where; to repeat
        its motion means nothing then, so this is NaN.
        """
        T_goal, center = self._sought.T_goal, self._sought.center
        tilt = np.arccos(np.clip(T[:, 2, 2], -1.0, 1.0))
        rise = se3.apply(T, center[None])[:, 0, 2] - center[2]
        columns = [tilt, rise, np.full(len(T), float(self.T_last is not None))]
        for known in (self.T_last, self.T_repeated):
            goals = T @ T_goal
            other = goals if known is None else known @ T_goal
            away, turn = se3.translation_distance(goals, other), se3.rotation_distance(goals, other)
            columns += [np.log1p(away / 0.01), turn]
        if self.T_last is None and se3.near(self.T_repeated, np.eye(4), *self._sought.config.same_motion):
            columns[-2:] = np.full((2, len(T)), np.nan)
        return np.stack(columns, axis=1)

    def _situation(self, count: int) -> FloatArray:
        """(count, 12) what is the same for all candidates: the hand, and what kind of region it is."""
        sought, step = self._sought, self._sought.step
        region, spread, w = sought.region, sought.template.spread, sought.template.weights
        size = np.ptp(region.cloud.points, axis=0).max()
        opening = self.target.query.observation.gripper_opening
        values = [
            float(len(region.p_gripper_held) > 0),
            float(step.action.gripper_open),
            opening - step.before.observation.gripper_opening,
            size,
            np.log1p(len(region.cloud)),
            region.weight.mean(),
            *(np.log(np.average(spread, weights=w[:, k] + 1e-9)) for k in (0, 1)),
            np.log(len(sought.turns)),
            sought.template.marks,
            self._palette,
            float(any(part.name == "goal" for part in sought.parts)),
        ]
        return np.tile(np.array(values, dtype=np.float64), (count, 1))
