"""Two matchers before the same search: one asks the networks, one compares descriptors."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import torch

from imop.candidates.pool import Asked, PolicyConfig
from imop.candidates.search import StepSearch
from imop.candidates.verification import Verifier
from imop.geometry.cloud import farthest_points
from imop.geometry.ransac import mutual_matches
from imop.networks.graph import build_graph
from imop.networks.matching import reposition
from imop.networks.model import Model
from imop.policy.learned_region import ShownRegion, find_shown_regions
from imop.policy.matcher import Hypothesis, Scene, Transition
from imop.policy.matches import Matches, likeliest
from imop.policy.region import Region, find_regions
from imop.policy.registration import RegistrationMatcher
from imop.policy.things import without_held
from imop.types import FloatArray


@dataclass(frozen=True)
class VerifiedMatcher:
    """Region and matching networks.

    Attributes:
        model: the networks; see `networks.model.load_model`.
        config: of the search.
    """

    model: Model
    config: PolicyConfig = field(default_factory=PolicyConfig)

    def prepare(self, steps: Sequence[Transition]) -> list["VerifiedStep"]:
        """Find the regions of a demonstration's steps and describe them."""
        shown = find_shown_regions(self.model, steps, self.config.threshold)
        return [
            VerifiedStep(self.model, self.config, step, region)
            for step, region in zip(steps, shown, strict=True)
        ]


class VerifiedStep:
    """A demonstrated step prepared for the matching network."""

    def __init__(self, model: Model, config: PolicyConfig, step: Transition, shown: ShownRegion) -> None:
        self._model, self._config, self._shown = model, config, shown
        points = shown.graph.points[shown.inside].double().numpy()
        few = farthest_points(points, model.config.matching.max_region)
        self._chosen = shown.inside[torch.from_numpy(few).sort().values]
        with torch.inference_mode():
            self._described = model.matching.describe(shown.steps, self._chosen)
        self._trust = shown.trust[self._chosen]
        self._weight = shown.probability[self._chosen].double().numpy()
        payload = None if shown.taken is None else shown.taken.cloud
        self.search = StepSearch(config, step, shown.region, payload, Verifier(model.verification), self._ask)

    @property
    def region(self) -> FloatArray:
        """(M, 3) points of the region in the demonstrated scene, with what is mostly in it completed."""
        return self._shown.completed

    def match(self, query: Scene, hints: Sequence[FloatArray] = ()) -> tuple[Hypothesis, ...]:
        """Where the region is in the query, likeliest first; see `PreparedStep.match`."""
        return self.search.match(query, hints)

    def _ask(self, query: Scene) -> Asked:
        """The network's matches in a query, and the motions that most of them agree on."""
        seen = build_graph(query.cloud, self._model.config.graph, query.ground)
        with torch.inference_mode():
            found = self._model.matching.match(self._described, seen)
            fits = [
                reposition(found.last, found.p_region, found.p_query, trust)
                for trust in (None, self._trust[None])
            ]
        matches = likeliest(
            found.last[0], self._shown.graph, self._chosen, seen, self._weight, self._config.candidates
        )
        fit, firm = (np.asarray(T[0].double().numpy()) for T in fits)
        return Asked({"fit": fit, "firm": firm}, matches)


@dataclass(frozen=True)
class DescribedMatcher:
    """Regions by rules and point feature histograms; of the networks only the verification.

    Attributes:
        model: with the verification network.
        descriptors: how points are described.
        config: of the search.
    """

    model: Model
    descriptors: RegistrationMatcher = field(default_factory=RegistrationMatcher)
    config: PolicyConfig = field(default_factory=PolicyConfig)

    def prepare(self, steps: Sequence[Transition]) -> list["DescribedStep"]:
        """Find the regions of a demonstration and describe them."""
        return [
            DescribedStep(self, step, region) for step, region in zip(steps, find_regions(steps), strict=True)
        ]


class DescribedStep:
    """A demonstrated step prepared for descriptors."""

    def __init__(self, matcher: DescribedMatcher, step: Transition, region: Region) -> None:
        self._descriptors, self._region = matcher.descriptors, region
        self._keypoints, self._described = matcher.descriptors.describe(region.cloud, 800)
        verifier = Verifier(matcher.model.verification)
        self.search = StepSearch(matcher.config, step, region, None, verifier, self._ask)

    @property
    def region(self) -> FloatArray:
        """(M, 3) points of the region in the demonstrated scene."""
        return self._region.cloud.points

    def match(self, query: Scene, hints: Sequence[FloatArray] = ()) -> tuple[Hypothesis, ...]:
        """Where the region is in the query, likeliest first; see `PreparedStep.match`."""
        return self.search.match(query, hints)

    def _ask(self, query: Scene) -> Asked:
        """Descriptors that choose each other."""
        standing = without_held(query.cloud.select(~query.ground.bare), query, self._region)
        keypoints, descriptors = self._descriptors.describe(standing, 2500)
        pairs = mutual_matches(self._described, descriptors)
        x, y = self._keypoints.select(pairs.i_support), keypoints.select(pairs.i_query)
        assert x.normals is not None and y.normals is not None
        return Asked({}, Matches(x.points, x.normals, y.points, y.normals, pairs.weight))
