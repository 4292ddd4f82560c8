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

from imop.geometry import se3
from imop.geometry.cloud import farthest_points
from imop.geometry.neighbours import nearest, within
from imop.networks.graph import Graph, build_graph
from imop.networks.matching import reposition
from imop.networks.model import Model
from imop.networks.region import StepBatch, one_step
from imop.policy.contacts import GRASP, SAME, find_contacts, is_open
from imop.policy.matcher import Hypothesis, Scene, Transition
from imop.policy.matches import Matches, likeliest
from imop.policy.objects import connected, find_objects
from imop.policy.refine import SMALLEST
from imop.policy.region import ENOUGH, Region
from imop.policy.search import Inquiry, Search, SearchConfig, upright_motions
from imop.policy.symmetry import equal_turns
from imop.policy.things import Things, middle, without_held
from imop.types import FloatArray

# A region of fewer points cannot be matched.
FEWEST = 8
# Share of what is held in the region of a step that lets go from which nothing else is in it.
LETS_GO = 0.8
# Matches nearer than this to where a motion carries them speak for it, metres; `TIGHT` for a part.
LOOSE, TIGHT = 0.03, 0.015
# What is connected to the region, this near to it (metres), is its context.
AROUND = 0.1
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
        objects = [find_objects(step.before.cloud, step.before.ground.plane) for step in steps]
        contacts = find_contacts(steps, objects)
        return [
            LearnedStep(self, step, p_held, bool(holding))
            for step, p_held, holding in zip(steps, contacts.p_gripper_held, contacts.holding, strict=True)
        ]


class LearnedStep:
    """A demonstrated step prepared for the matching network."""

    def __init__(
        self, matcher: LearnedMatcher, step: Transition, p_gripper_held: FloatArray, holding: bool
    ) -> None:
        self._matcher = matcher
        model = matcher.model
        config = model.config.graph
        before, after = (build_graph(s.cloud, config, s.ground) for s in (step.before, step.after))
        with torch.inference_mode():
            logits = model.region(_batch(step, before, after, config.neighbours))[-1]
            self._described = model.matching.backbone(before)
        probability = torch.sigmoid(logits)
        inside = self._inside(probability)
        self._region = _dense(step, before, probability, inside, p_gripper_held)
        few = farthest_points(before.points[inside].double().numpy(), model.config.matching.max_region)
        self._graph, self._chosen = before, inside[torch.from_numpy(few).sort().values]
        self._probability = probability[self._chosen].double().numpy()
        self._middles = [middle(self.region)]
        if self._region.context is not None:
            self._middles.append(middle(self._region.whole.points))
        self._search = Search(matcher.search, step.before, self._region)
        self._turns = equal_turns(self._search.template.surface.colorless(), self._middles[0])
        self._part = self._region.next_to(step.action.T_world_gripper[:3, 3], NEXT_TO)
        self._before = step.before
        tip = step.before.observation.T_world_gripper[None, :3, 3]
        self._in_hand = holding and bool(within(tip, self._part.cloud.points, GRASP)[0])

    @cached_property
    def _search_part(self) -> Search:
        """Few steps need it, and it takes as long to prepare as that of the region."""
        return Search(self._matcher.search, self._before, self._part)

    def _inside(self, probability: Tensor) -> Tensor:
        """(R,) points of the region, in order of their index; the likeliest few if there seems to be none."""
        count = int((probability > self._matcher.threshold).sum())
        count = min(max(count, FEWEST), len(probability))
        return probability.topk(count).indices.sort().values

    @property
    def region(self) -> FloatArray:
        """(M, 3) points of the region in the demonstrated scene."""
        return self._region.cloud.points

    def match(self, query: Scene, hints: Sequence[FloatArray] = ()) -> tuple[Hypothesis, ...]:
        """Where the region is in the query, best first; see `PreparedStep.match`."""
        if len(query.cloud) < 5:
            return ()
        model = self._matcher.model
        seen = build_graph(query.cloud, model.config.graph, query.ground)
        with torch.inference_mode():
            found = model.matching(self._graph, self._chosen, seen, self._described)
        standing = without_held(query.cloud.select(~query.ground.bare), query, self._region)
        if len(standing) < 5:
            return ()
        matches = likeliest(
            found.last[0], self._graph, self._chosen, seen, self._probability, self._matcher.candidates
        )
        fit = reposition(found.last, found.p_region, found.p_query).double().numpy()
        things = Things(query, standing)
        inquiry = Inquiry(self._search, things, hints, partial(self._opinion, matches))
        trusted = self._trusted(matches, fit, hints)
        confirmed = inquiry.confirm(np.stack(trusted)) if trusted else ()
        if confirmed:
            return confirmed
        whole = inquiry.search(np.concatenate([fit, self._seeds(matches, things)]))
        if whole[0].score > BENT:
            return whole
        best = np.stack([hypothesis.T_query_support for hypothesis in whole[:KEPT]])
        whole = inquiry.search(np.concatenate([best, self._anywhere(things)]))
        return whole if whole[0].score > BENT else self._unbent(matches, inquiry, whole)

    def _unbent(
        self, matches: Matches, inquiry: Inquiry, whole: tuple[Hypothesis, ...]
    ) -> tuple[Hypothesis, ...]:
        """Where the part of the region next to the gripper is, if that contradicts where the whole is.

        A part in the hand has moved as the gripper has.
        """
        near = matches.of(self._part.cloud.points)
        if len(near.x) < 3 or len(self._part.cloud) < SMALLEST:
            return whole
        opinion = partial(self._opinion, near)
        T_whole = whole[0].T_query_support
        for_whole = self._opinion(near, T_whole[None], TIGHT)[0]
        if for_whole >= CONTRADICTED and not self._in_hand:
            return whole
        closer = Inquiry(self._search_part, inquiry.things, inquiry.hints, opinion)
        if self._in_hand:
            part = closer.repeated()
        else:
            seeds = self._seeds(near, inquiry.things)
            if not len(seeds):
                return whole
            part = closer.search(seeds)
        T_part = part[0].T_query_support
        if closer.alike(T_part, T_whole):
            return whole
        if self._in_hand:
            return part
        certain = opinion(T_part[None])[0] > CERTAIN
        contradicted = for_whole < CONTRADICTED * self._opinion(near, T_part[None], TIGHT)[0]
        explained = max(AS_GOOD * whole[0].score, closer.finished(T_whole).score + BETTER)
        return part if certain and contradicted and part[0].score > explained else whole

    def _trusted(self, m: Matches, fit: FloatArray, hints: Sequence[FloatArray]) -> list[FloatArray]:
        """Motions worth a look before a search; none if many turns are equal, for then a few compete."""
        if len(self._turns) > 1:
            return []
        agreed = m.agreement(fit)[0] > self._matcher.trusted
        return [*hints, *fit] if agreed else list(hints)

    def _opinion(self, m: Matches, T: FloatArray, tolerance: float = LOOSE) -> FloatArray:
        """(H,) share of the matches that speak for motions (H, 4, 4), in any of the turns of equal shape.

        Of a round jar the networks match any side to any; its label is for the judge.
        """
        turned = (T[:, None] @ self._turns).reshape(-1, 4, 4)
        support: FloatArray = m.agreement(turned, tolerance).reshape(len(T), -1).max(axis=1)
        return support

    def _seeds(self, m: Matches, things: Things) -> FloatArray:
        """(H, 4, 4) motions that matches speak for."""
        matcher = self._matcher
        agreed = m.motions(matcher.samples, matcher.seed)
        upright = m.upright(things, matcher.places, matcher.turns, self._middles)
        return np.concatenate([agreed, upright])

    def _anywhere(self, things: Things) -> FloatArray:
        """(H, 4, 4) motions, in every turn, to every thing there is: the matches may be of a wrong one."""
        places, turns = things.places(ENOUGH), self._matcher.turns
        return np.concatenate([upright_motions(center, places, turns) for center in self._middles])


def _batch(step: Transition, before: Graph, after: Graph, neighbours: int) -> StepBatch:
    observation, action = step.before.observation, step.action
    poses = np.stack([action.T_world_gripper, observation.T_world_gripper])
    gripper = torch.tensor([is_open(step), action.gripper_open], dtype=torch.float32)
    return one_step(before, after, torch.from_numpy(poses.astype(np.float32)), gripper, neighbours)


def _dense(
    step: Transition, graph: Graph, probability: Tensor, inside: Tensor, p_gripper_held: FloatArray
) -> Region:
    """The region on the full cloud: every point belongs as much as the nearest point of the graph does."""
    cloud = step.before.cloud
    weight = torch.zeros_like(probability).index_copy(0, inside, probability[inside]).double().numpy()
    owner = nearest(cloud.points, graph.points.double().numpy())[1][:, 0]
    member = weight[owner] > 0
    # The bare table is found everywhere.
    standing = ~step.before.ground.bare
    member = member & standing if (member & standing).sum() >= FEWEST else member
    p_held = se3.apply(step.before.observation.T_world_gripper, p_gripper_held)
    in_hand = within(cloud.points, p_held, SAME) if len(p_held) else np.zeros(len(cloud), dtype=bool)
    # A step that lets go is fixed to what stays, not to what is let go.
    most = LETS_GO if step.action.gripper_open else 0.5
    if (member & ~in_hand).sum() >= FEWEST and in_hand[member].mean() < most:
        member = member & ~in_hand
    else:
        in_hand, p_gripper_held = np.zeros(len(cloud), dtype=bool), p_gripper_held[:0]
    region = cloud.select(member)
    free = np.flatnonzero(standing & ~in_hand | member)
    labels, own = connected(cloud.points[free]), member[free]
    # What only stands by says nothing about the region.
    around = ~own & np.isin(labels, labels[own]) & within(cloud.points[free], region.points, AROUND)
    context = cloud.select(free[around]) if around.any() else None
    return Region(region, weight[owner[member]], p_gripper_held, context, firm=True)
