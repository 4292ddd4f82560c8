"""The learned matcher: the paper's region and matching networks, then the same judgement as registration.

The region network says once per demonstrated step which points the action is fixed to. The matching network
says which points of the query they are. The paper fits one motion to all of these matches; where several
equal things are in view that is the average of several answers, so that here triples of matches that agree
propose motions, and what the cameras saw decides between them and refines the best.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np
import torch
from torch import Tensor

from imop.geometry.cloud import farthest_points
from imop.geometry.neighbours import within
from imop.networks.graph import Graph, build_graph
from imop.networks.matching import reposition
from imop.networks.model import Model
from imop.policy.contacts import GRASP, SAME
from imop.policy.evidence import Surface
from imop.policy.learned_region import FEWEST, ShownRegion, find_shown_regions
from imop.policy.matcher import Hypothesis, Scene, Transition
from imop.policy.matches import Matches, likeliest
from imop.policy.refine import SMALLEST
from imop.policy.region import ENOUGH, Region
from imop.policy.search import Inquiry, Search, SearchConfig, upright_motions
from imop.policy.symmetry import equal_turns
from imop.policy.things import Things, middle, without_held
from imop.types import FloatArray

# Matches nearer than this to where a motion carries them speak for it, metres; `TIGHT` for a part.
LOOSE, TIGHT = 0.03, 0.015
# A region that no motion explains better than this may have bent. What of it is within `NEXT_TO` metres of
# where the gripper goes has not. It is found instead if this share of its matches speaks for that, if they
# support the whole less than this share of what they support the part, if it is explained there better than
# where the whole is by this score, and about as well as the whole.
BENT = 0.7
NEXT_TO = 0.05
CERTAIN, CONTRADICTED = 0.8, 0.9
BETTER, AS_GOOD = 0.1, 0.85
# How many of the best motions compete with those to all other things.
KEPT = 6


@dataclass(frozen=True)
class LearnedMatcher:
    """Region and matching networks, no descriptors made by hand.

    Attributes:
        model: the networks; see `networks.model.load_model`.
        threshold: least probability of a region point.
        candidates: query points per region point that may be matched.
        trusted: share of the matches from which the motion that most agree on is looked at before all others.
        samples: triples drawn from the matches.
        places: things of the query on which the region is set upright, too.
        turns: how often, over a full turn.
        search: how the motions are refined and judged.
        seed: of the sampling.
    """

    model: Model
    threshold: float = 0.5
    candidates: int = 2
    trusted: float = 0.5
    samples: int = 4000
    places: int = 2
    turns: int = 24
    search: SearchConfig = field(
        default_factory=lambda: SearchConfig(finished=2, righted=3, turned=4, turn=0.05, sure=0.72)
    )
    seed: int = 0

    def prepare(self, steps: Sequence[Transition]) -> list["LearnedStep"]:
        """Find the regions of a demonstration's steps and describe them."""
        shown = find_shown_regions(self.model, steps, self.threshold)
        return [LearnedStep(self, step, region) for step, region in zip(steps, shown, strict=True)]


class Sought:
    """One region of a demonstrated step, as the matching network and the search look for it."""

    def __init__(
        self, matcher: LearnedMatcher, before: Scene, shown: ShownRegion, described: Tensor, region: Region
    ) -> None:
        self._matcher, self._graph, self._described = matcher, shown.graph, described
        self.region = region
        inside = shown.inside if region is shown.region else _nodes(shown.graph, region)
        few = farthest_points(shown.graph.points[inside].double().numpy(), self._most)
        self._chosen = inside[torch.from_numpy(few).sort().values]
        self._probability = shown.probability[self._chosen].double().numpy()
        self.search = Search(matcher.search, before, region)
        self._middles = [middle(region.cloud.points)]
        if region.context is not None:
            self._middles.append(middle(region.whole.points))
        self._turns = equal_turns(self.search.template.surface.colorless(), self._middles[0])

    @property
    def _most(self) -> int:
        return self._matcher.model.config.matching.max_region

    def matched(self, seen: Graph) -> tuple[Matches, FloatArray]:
        """The network's matches in a query, and the motions (H, 4, 4) that most of them agree on."""
        with torch.inference_mode():
            found = self._matcher.model.matching(self._graph, self._chosen, seen, self._described)
        C, candidates = found.last[0], self._matcher.candidates
        matches = likeliest(C, self._graph, self._chosen, seen, self._probability, candidates)
        return matches, reposition(found.last, found.p_region, found.p_query).double().numpy()

    def trusted(self, m: Matches, fit: FloatArray, hints: Sequence[FloatArray]) -> list[FloatArray]:
        """Motions worth a look before a search; none if many turns are equal, for then a few compete."""
        if len(self._turns) > 1:
            return []
        agreed = m.agreement(fit)[0] > self._matcher.trusted
        return [*hints, *fit] if agreed else list(hints)

    def opinion(self, m: Matches, T: FloatArray, tolerance: float = LOOSE) -> FloatArray:
        """(H,) share of the matches that speak for motions (H, 4, 4), in any of the turns of equal shape.

        Of a round jar the networks match any side to any; its label is for the judge.
        """
        turned = (T[:, None] @ self._turns).reshape(-1, 4, 4)
        support: FloatArray = m.agreement(turned, tolerance).reshape(len(T), -1).max(axis=1)
        return support

    def seeds(self, m: Matches, things: Things) -> FloatArray:
        """(H, 4, 4) motions that matches speak for."""
        matcher = self._matcher
        agreed = m.motions(matcher.samples, matcher.seed)
        upright = m.upright(things, matcher.places, matcher.turns, self._middles)
        return np.concatenate([agreed, upright])

    def anywhere(self, things: Things) -> FloatArray:
        """(H, 4, 4) motions, in every turn, to every thing there is: the matches may be of a wrong one."""
        places, turns = things.places(ENOUGH), self._matcher.turns
        return np.concatenate([upright_motions(center, places, turns) for center in self._middles])


class LearnedStep:
    """A demonstrated step prepared for the matching network."""

    def __init__(self, matcher: LearnedMatcher, step: Transition, shown: ShownRegion) -> None:
        self._config, self._model, self._before = matcher.search, matcher.model, step.before
        with torch.inference_mode():
            described = self._model.matching.backbone(shown.graph)
        region = shown.region
        self._sought = Sought(matcher, step.before, shown, described, region)
        self._taken = None
        if shown.taken is not None and len(_nodes(shown.graph, shown.taken)) >= FEWEST:
            self._taken = Sought(matcher, step.before, shown, described, shown.taken)
            rest = region.whole.select(~within(region.whole.points, shown.taken.cloud.points, SAME))
            self._rest = Surface(rest, ())
        self._part = region.next_to(step.action.T_world_gripper[:3, 3], NEXT_TO)
        tip = step.before.observation.T_world_gripper[None, :3, 3]
        self._in_hand = shown.holding and bool(within(tip, self._part.cloud.points, GRASP)[0])

    @cached_property
    def _search_part(self) -> Search:
        """Few steps need it, and it takes as long to prepare as that of the region."""
        return Search(self._config, self._before, self._part)

    @property
    def region(self) -> FloatArray:
        """(M, 3) points of the region in the demonstrated scene."""
        return self._sought.region.cloud.points

    def match(self, query: Scene, hints: Sequence[FloatArray] = ()) -> tuple[Hypothesis, ...]:
        """Where the region is in the query, best first; see `PreparedStep.match`."""
        if len(query.cloud) < 5:
            return ()
        standing = without_held(query.cloud.select(~query.ground.bare), query, self._sought.region)
        if len(standing) < 5:
            return ()
        seen = build_graph(query.cloud, self._model.config.graph, query.ground)
        things = Things(query, standing)
        matches, fit = self._sought.matched(seen)
        inquiry = Inquiry(self._sought.search, things, hints, partial(self._sought.opinion, matches))
        whole = self._whole(matches, fit, inquiry)
        return whole if self._taken is None else self._loose(self._taken, seen, inquiry, whole)

    def _whole(self, matches: Matches, fit: FloatArray, inquiry: Inquiry) -> tuple[Hypothesis, ...]:
        """Where the whole region is, or the part of it that is next to the gripper."""
        sought, things = self._sought, inquiry.things
        trusted = sought.trusted(matches, fit, inquiry.hints)
        confirmed = inquiry.confirm(np.stack(trusted)) if trusted else ()
        if confirmed:
            return confirmed
        whole = inquiry.search(np.concatenate([fit, sought.seeds(matches, things)]))
        if whole[0].score > BENT:
            return whole
        best = np.stack([hypothesis.T_query_support for hypothesis in whole[:KEPT]])
        whole = inquiry.search(np.concatenate([best, sought.anywhere(things)]))
        return whole if whole[0].score > BENT else self._unbent(matches, inquiry, whole)

    def _loose(
        self, taken: Sought, seen: Graph, inquiry: Inquiry, whole: tuple[Hypothesis, ...]
    ) -> tuple[Hypothesis, ...]:
        """Where what the hand takes is, if it is not where it would be in the whole region.

        Notes on a safe may lie anywhere on it. They are looked for in what the rest of the region leaves.
        """
        T_whole, things = whole[0].T_query_support, inquiry.things
        there = Inquiry(taken.search, things).finished(T_whole)
        left = things.unexplained(self._rest, T_whole)
        if there.score > BENT or left is None:
            return whole
        matches, fit = taken.matched(seen)
        alone = Inquiry(taken.search, things, inquiry.hints, partial(taken.opinion, matches))
        found = alone.search(
            np.concatenate([T_whole[None], fit, taken.seeds(matches, left), taken.anywhere(left)])
        )
        return found if found[0].score > there.score + BETTER else whole

    def _unbent(
        self, matches: Matches, inquiry: Inquiry, whole: tuple[Hypothesis, ...]
    ) -> tuple[Hypothesis, ...]:
        """Where the part of the region next to the gripper is, if that contradicts where the whole is.

        A part in the hand has moved as the gripper has.
        """
        near = matches.of(self._part.cloud.points)
        if len(near.x) < 3 or len(self._part.cloud) < SMALLEST:
            return whole
        opinion = partial(self._sought.opinion, near)
        T_whole = whole[0].T_query_support
        for_whole = self._sought.opinion(near, T_whole[None], TIGHT)[0]
        if for_whole >= CONTRADICTED and not self._in_hand:
            return whole
        closer = Inquiry(self._search_part, inquiry.things, inquiry.hints, opinion)
        if self._in_hand:
            part = closer.repeated()
        else:
            seeds = self._sought.seeds(near, inquiry.things)
            if not len(seeds):
                return whole
            part = closer.search(seeds)
        T_part = part[0].T_query_support
        if closer.alike(T_part, T_whole):
            return whole
        if self._in_hand:
            return part
        certain = opinion(T_part[None])[0] > CERTAIN
        contradicted = for_whole < CONTRADICTED * self._sought.opinion(near, T_part[None], TIGHT)[0]
        explained = max(AS_GOOD * whole[0].score, closer.finished(T_whole).score + BETTER)
        return part if certain and contradicted and part[0].score > explained else whole


def _nodes(graph: Graph, region: Region) -> Tensor:
    """(R,) points of the graph that a region is at."""
    near = within(graph.points.double().numpy(), region.cloud.points, SAME)
    return torch.from_numpy(np.flatnonzero(near))
