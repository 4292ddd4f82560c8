"""One region of a demonstrated step, as the matching network and the search look for it."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import torch
from torch import Tensor

from imop.geometry.cloud import farthest_points
from imop.geometry.neighbours import within
from imop.networks.graph import Graph
from imop.networks.matching import reposition
from imop.networks.model import Model
from imop.policy.contacts import SAME
from imop.policy.learned_region import ShownRegion
from imop.policy.matcher import Scene
from imop.policy.matches import Matches, likeliest
from imop.policy.region import ENOUGH, Region
from imop.policy.search import Search, SearchConfig, upright_motions
from imop.policy.symmetry import equal_turns
from imop.policy.things import Things, middle
from imop.types import FloatArray

# Matches nearer than this to where a motion carries them speak for it, metres.
LOOSE = 0.03


@dataclass(frozen=True)
class SoughtConfig:
    """How matches become motions.

    Attributes:
        candidates: query points per region point that may be matched.
        trusted: share of the matches from which the motion that most agree on is looked at before all others.
        samples: triples drawn from the matches.
        places: things of the query on which the region is set upright, too.
        turns: how often, over a full turn.
        threads: of the matching network; the small one loses more by waiting for a second than that does.
        search: how the motions are refined and judged.
        seed: of the sampling.
    """

    candidates: int = 2
    trusted: float = 0.5
    samples: int = 4000
    places: int = 2
    turns: int = 24
    threads: int = 1
    search: SearchConfig = field(
        default_factory=lambda: SearchConfig(finished=2, righted=3, turned=4, turn=0.02, sure=0.72)
    )
    seed: int = 0


class Sought:
    """A region, prepared for any number of queries.

    Args:
        config: how to look for it.
        model: with the matching network.
        before: the demonstrated scene.
        shown: its graph and its region.
        features: of the graph, by the matching network's backbone.
        region: what is looked for; `shown.region` or a part of it.

    Attributes:
        region: the same.
        search: of it.
    """

    def __init__(
        self,
        config: SoughtConfig,
        model: Model,
        before: Scene,
        shown: ShownRegion,
        features: Tensor,
        region: Region,
    ) -> None:
        self._config, self._model, self._before = config, model, before
        self._graph, self.region = shown.graph, region
        inside = shown.inside if region is shown.region else nodes_at(shown.graph, region)
        few = farthest_points(shown.graph.points[inside].double().numpy(), model.config.matching.max_region)
        self._chosen = inside[torch.from_numpy(few).sort().values]
        with torch.inference_mode():
            self._described = model.matching.describe(shown.steps, self._chosen, features)
        self._probability = shown.probability[self._chosen].double().numpy()
        self._loose = region is not shown.region
        self.search = Search(config.search, before, region, self._loose)
        self._middles = [middle(region.cloud.points)]
        if region.context is not None:
            self._middles.append(middle(region.whole.points))
        self._turns = equal_turns(self.search.template.surface.colorless(), self._middles[0])

    @cached_property
    def search_colorless(self) -> Search:
        """What is needed where no motion explains the region with its colours."""
        return Search(self._config.search, self._before, self.region.colorless(), self._loose)

    def matched(self, seen: Graph) -> tuple[Matches, FloatArray]:
        """The network's matches in a query, and the motions (H, 4, 4) that most of them agree on."""
        with torch.inference_mode(), threads(self._config.threads):
            found = self._model.matching.match(self._described, seen)
            fit = reposition(found.last, found.p_region, found.p_query)
        C, candidates = found.last[0], self._config.candidates
        matches = likeliest(C, self._graph, self._chosen, seen, self._probability, candidates)
        return matches, fit.double().numpy()

    def trusted(self, m: Matches, fit: FloatArray) -> FloatArray:
        """(H, 4, 4) motions worth a look before a search: what most matches agree on.

        None if many turns are equal: which of them is the best has to be searched.
        """
        agreed = len(self._turns) == 1 and m.agreement(fit)[0] > self._config.trusted
        return fit if agreed else np.zeros((0, 4, 4))

    def opinion(self, m: Matches, T: FloatArray, tolerance: float = LOOSE) -> FloatArray:
        """(H,) share of the matches that speak for motions (H, 4, 4), in any of the turns of equal shape.

        Of a round jar the networks match any side to any; its label is for the judge.
        """
        turned = (T[:, None] @ self._turns).reshape(-1, 4, 4)
        support: FloatArray = m.agreement(turned, tolerance).reshape(len(T), -1).max(axis=1)
        return support

    def seeds(self, m: Matches, things: Things) -> FloatArray:
        """(H, 4, 4) motions that matches speak for."""
        config = self._config
        agreed = m.motions(config.samples, config.seed)
        upright = m.upright(things, config.places, config.turns, self._middles)
        return np.concatenate([agreed, upright])

    def anywhere(self, things: Things) -> FloatArray:
        """(H, 4, 4) motions, in every turn, to every thing there is: the matches may be of a wrong one."""
        places, turns = things.places(ENOUGH), self._config.turns
        return np.concatenate([upright_motions(center, places, turns) for center in self._middles])


@contextmanager
def threads(count: int) -> Iterator[None]:
    """Torch with so many threads, for a while."""
    before = torch.get_num_threads()
    torch.set_num_threads(count)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def nodes_at(graph: Graph, region: Region) -> Tensor:
    """(R,) points of the graph that a region is at."""
    near = within(graph.points.double().numpy(), region.cloud.points, SAME)
    return torch.from_numpy(np.flatnonzero(near))
