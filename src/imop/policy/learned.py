"""The learned matcher: the paper's region and matching networks, then the same judgement as registration.

The region network says once per demonstrated step which points the action is fixed to. The matching network
says which points of the query they are. The paper fits one motion to all of these matches; where several
equal things are in view that is the average of several answers, so that here triples of matches that agree
propose motions, and what the cameras saw decides between them and refines the best.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
import torch

from imop.geometry.cloud import PointCloud
from imop.geometry.icp import SMALLEST
from imop.geometry.neighbours import nearest, within
from imop.networks.graph import Graph, build_graph
from imop.networks.model import Model
from imop.policy.contacts import GRASP, SAME
from imop.policy.evidence import Surface
from imop.policy.inquiry import Inquiry
from imop.policy.learned_region import FEWEST, ShownRegion, find_shown_regions
from imop.policy.matcher import Hypothesis, Scene, Transition
from imop.policy.matches import Matches
from imop.policy.region import ENOUGH, Region
from imop.policy.search import Search
from imop.policy.sought import Sought, SoughtConfig, nodes_at
from imop.policy.things import Things, without_held
from imop.types import FloatArray

# Matches of a part nearer than this to where a motion carries them speak for it, metres.
TIGHT = 0.015
# A region that no motion explains better than this may have bent. What of it is within `NEXT_TO` metres of
# where the gripper goes has not. It is found instead if this share of its matches speaks for that, if they
# support the whole less than this share of what they support the part, if it is explained there better than
# where the whole is by this score, and about as well as the whole.
BENT = 0.7
NEXT_TO = 0.05
CERTAIN, CONTRADICTED = 0.8, 0.9
BETTER, AS_GOOD = 0.1, 0.85
# What is explained better than this does not bend.
STIFF = 0.8
# A hand that is as wide open as it was shown, up to this share of its stroke, holds what it held.
AS_WIDE = 0.04
# What the hand takes is somewhere else than the region says only if it is explained there by this score.
FOUND = 0.6
# A region that no motion explains better than this may have another colour. What is found by its shape alone
# is as sure as this at most.
LOST, BY_SHAPE = 0.45, 0.8
# How many of the best motions compete with those to all other things.
KEPT = 6


@dataclass(frozen=True)
class LearnedMatcher:
    """Region and matching networks, no descriptors made by hand.

    Attributes:
        model: the networks; see `networks.model.load_model`.
        threshold: least probability of a region point.
        sought: how regions are looked for.
    """

    model: Model
    threshold: float = 0.5
    sought: SoughtConfig = field(default_factory=SoughtConfig)

    def prepare(self, steps: Sequence[Transition]) -> list["LearnedStep"]:
        """Find the regions of a demonstration's steps and describe them."""
        shown = find_shown_regions(self.model, steps, self.threshold)
        return [
            LearnedStep(self.model, self.sought, step, region)
            for step, region in zip(steps, shown, strict=True)
        ]


class LearnedStep:
    """A demonstrated step prepared for the matching network."""

    def __init__(self, model: Model, config: SoughtConfig, step: Transition, shown: ShownRegion) -> None:
        self._model, self._config, self._before = model, config, step.before
        with torch.inference_mode():
            features = model.matching.backbone(shown.graph)
        prepare = partial(Sought, config, model, step.before, shown, features)
        region, taken, self._completed = shown.region, shown.taken, shown.completed
        self._sought, self._taken = prepare(region), None
        if taken is not None and len(nodes_at(shown.graph, taken)) >= FEWEST:
            self._taken = prepare(taken)
            rest = region.whole.select(~within(region.whole.points, taken.cloud.points, SAME))
            self._rest = Surface(rest, ())
        self._goal = step.action.T_world_gripper[:3, 3]
        self._part = region.next_to(self._goal, NEXT_TO)
        self._opening = step.before.observation.gripper_opening
        tip = step.before.observation.T_world_gripper[None, :3, 3]
        touched = len(self._part.cloud) >= SMALLEST and within(tip, self._part.cloud.points, GRASP)[0]
        self._in_hand = shown.holding and bool(touched)

    @cached_property
    def _search_part(self) -> Search:
        """Of what is next to the gripper; few steps need it, and it takes long to prepare."""
        part = self._part.colorless() if self._in_hand else self._part
        return Search(self._config.search, self._before, part)

    @property
    def region(self) -> FloatArray:
        """(M, 3) points of the region in the demonstrated scene, with what is mostly in it completed."""
        return self._completed

    def match(self, query: Scene, hints: Sequence[FloatArray] = ()) -> tuple[Hypothesis, ...]:
        """Where the region is in the query, best first; see `PreparedStep.match`."""
        if len(query.fused) < 5:
            return ()
        return self._followed(query, hints) or self._searched(query, hints)

    def _followed(self, query: Scene, hints: Sequence[FloatArray]) -> tuple[Hypothesis, ...]:
        """Where the region is if it has moved as what was acted on before; no network need be asked."""
        if not hints:
            return ()
        search = self._sought.search
        standing = query.fused.select(~query.ground.bare)
        near = standing.select(search.around(standing.points, search.likely(query, hints)))
        near = without_held(near, query, self._sought.region)
        if len(near) < SMALLEST:
            return ()
        things = Things(query, near)
        inquiry = Inquiry(search, things, hints)
        found = inquiry.followed()
        if not found and self._in_hand and abs(query.observation.gripper_opening - self._opening) < AS_WIDE:
            slipped = inquiry.slipped()
            return (slipped,) if slipped.score > BENT else self._in_the_hand(things).repeated()
        if found and self._taken is not None:
            taken = self._there(self._taken, things, found[0].T_query_support)
            return found if taken.score > BENT else ()
        return found

    def _searched(self, query: Scene, hints: Sequence[FloatArray]) -> tuple[Hypothesis, ...]:
        """Where the networks and what was seen say that the region is."""
        standing = query.cloud.select(~query.ground.bare)
        standing = without_held(standing, query, self._sought.region)
        if len(standing) < SMALLEST:
            return ()
        things = Things(query, standing)
        seen = build_graph(query.cloud, self._model.config.graph, query.ground)
        matches, fit = self._sought.matched(seen)
        inquiry = Inquiry(self._sought.search, things, hints, partial(self._sought.opinion, matches))
        whole = self._whole(matches, fit, inquiry)
        found = whole if self._taken is None else self._loose(self._taken, seen, inquiry, whole)
        # What is in the hand is where the hand is, whatever its colour.
        known = self._in_hand or found[0].score > LOST
        return found if known else self._recolored(inquiry, found)

    def _whole(self, matches: Matches, fit: FloatArray, inquiry: Inquiry) -> tuple[Hypothesis, ...]:
        """Where the whole region is, or the part of it that is next to the gripper."""
        sought, things = self._sought, inquiry.things
        if confirmed := inquiry.confirmed(sought.trusted(matches, fit)):
            return self._bent(inquiry, confirmed)
        whole = inquiry.search(np.concatenate([fit, sought.seeds(matches, things)]))
        if whole[0].score > BENT:
            return whole
        best = np.stack([hypothesis.T_query_support for hypothesis in whole[:KEPT]])
        whole = inquiry.search(np.concatenate([best, sought.anywhere(things)]))
        if whole[0].score > BENT:
            return whole
        if self._in_hand:
            return self._held(inquiry, whole)
        return self._bent(inquiry, self._unbent(matches, inquiry, whole))

    @staticmethod
    def _there(taken: Sought, things: Things, T_whole: FloatArray) -> Hypothesis:
        """What the hand takes, where the region says that it is."""
        return Inquiry(taken.search, things).finished(T_whole)

    def _loose(
        self, taken: Sought, seen: Graph, inquiry: Inquiry, whole: tuple[Hypothesis, ...]
    ) -> tuple[Hypothesis, ...]:
        """Where what the hand takes is, if it is not where it would be in the whole region.

        Notes on a safe may lie anywhere on it. They are looked for in what the rest of the region leaves.
        """
        T_whole, things = whole[0].T_query_support, inquiry.things
        there = self._there(taken, things, T_whole)
        left = things.unexplained(self._rest, T_whole)
        if there.score > BENT or left is None:
            return whole
        matches, fit = taken.matched(seen)
        alone = Inquiry(taken.search, things, inquiry.hints, partial(taken.opinion, matches))
        found = alone.search(
            np.concatenate([T_whole[None], fit, taken.seeds(matches, left), taken.anywhere(left)])
        )
        return found if found[0].score > max(FOUND, there.score + BETTER) else whole

    def _recolored(self, inquiry: Inquiry, found: tuple[Hypothesis, ...]) -> tuple[Hypothesis, ...]:
        """What is of the same shape in another colour, rather not in that of another thing shown.

        Where the cups other than the red one have new colours, the red one is still not one of them.
        """
        sought, things = self._taken or self._sought, inquiry.things
        seeds = [np.stack([h.T_query_support for h in found[:KEPT]]), sought.anywhere(things)]
        gray = Inquiry(sought.search_colorless, things.colorless(), inquiry.hints)
        shaped = gray.search(np.concatenate(seeds))
        if shaped[0].score < BENT:
            return found
        known = things.colored_like(self._beside(sought.region))
        points = things.cloud.points

        def another(hypothesis: Hypothesis) -> bool:
            return bool(known[nearest(hypothesis.p_query, points)[1][:, 0]].mean() > 0.5)

        good = [h for h in shaped if h.score > BENT]
        return tuple(replace(h, score=BY_SHAPE * h.score) for h in sorted(good, key=another))

    def _beside(self, region: Region) -> PointCloud:
        """What else than a region stood in the demonstrated scene."""
        cloud = self._before.cloud
        return cloud.select(~self._before.ground.bare & ~within(cloud.points, region.cloud.points, SAME))

    def _in_the_hand(self, things: Things) -> Inquiry:
        """About what is next to the gripper, whatever its colour: it has moved as the gripper has."""
        return Inquiry(self._search_part, things.colorless())

    def _held(self, inquiry: Inquiry, whole: tuple[Hypothesis, ...]) -> tuple[Hypothesis, ...]:
        """What is in the hand: as it was found, if that is where it has been carried, else as carried."""
        closer = self._in_the_hand(inquiry.things)
        carried = closer.repeated()
        alike = closer.alike(carried[0].T_query_support, whole[0].T_query_support)
        return whole if alike and whole[0].score > carried[0].score else carried

    def _bent(self, inquiry: Inquiry, found: tuple[Hypothesis, ...]) -> tuple[Hypothesis, ...]:
        """Where what is next to the gripper is, if it points elsewhere than where it was found."""
        points = self._part.cloud.points
        if self._in_hand or found[0].score > STIFF or len(points) < ENOUGH:
            return found
        goal = points[nearest(self._goal[None], points)[1][0, 0]]
        return Inquiry(self._search_part, inquiry.things, inquiry.hints).bent(found, goal)

    def _unbent(
        self, matches: Matches, inquiry: Inquiry, whole: tuple[Hypothesis, ...]
    ) -> tuple[Hypothesis, ...]:
        """Where the part of the region next to the gripper is, if that contradicts where the whole is."""
        near = matches.of(self._part.cloud.points)
        if len(near.x) < 3 or len(self._part.cloud) < SMALLEST:
            return whole
        opinion = partial(self._sought.opinion, near)
        T_whole = whole[0].T_query_support
        for_whole = self._sought.opinion(near, T_whole[None], TIGHT)[0]
        seeds = self._sought.seeds(near, inquiry.things)
        if for_whole >= CONTRADICTED or not len(seeds):
            return whole
        closer = Inquiry(self._search_part, inquiry.things, inquiry.hints, opinion)
        part = closer.search(seeds)
        T_part = part[0].T_query_support
        if closer.alike(T_part, T_whole):
            return whole
        certain = opinion(T_part[None])[0] > CERTAIN
        contradicted = for_whole < CONTRADICTED * self._sought.opinion(near, T_part[None], TIGHT)[0]
        explained = max(AS_GOOD * whole[0].score, closer.finished(T_whole).score + BETTER)
        if not (certain and contradicted and part[0].score > explained):
            return whole
        return closer.kept(part)
