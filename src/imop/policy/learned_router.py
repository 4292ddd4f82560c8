"""The learned router: what the routing network sees, weighed with what was done so far.

The network says how well each demonstrated state fits what is seen, without being told what comes next. The
episode says what is to be expected, as odds:

- the step after the one taken last: 1;
- a step before that, since an action can fail: `back`, and for each step farther back times `farther`;
- any step after it, since what a step would do may be done already: `skip`;
- the same in another demonstration than the one followed so far: times `change`.

The product of odds and the network's probability decides, so that where the states of several steps look the
same the episode's order does. A step that was taken 1 + `retries` times is only taken again where it is the
expected one, so that an episode goes on.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from imop.networks.graph import build_graph
from imop.networks.model import Model
from imop.networks.routing import UNKNOWN, Described, States, make_states
from imop.policy.matcher import Scene, Transition
from imop.types import FloatArray


@dataclass(frozen=True)
class Odds:
    """How likely the steps are before anything is seen, against the expected one.

    Attributes:
        back: of the step before.
        farther: of every step farther back, against the one after it.
        skip: of a later step.
        change: of another demonstration than the one followed so far.
        retries: how often a step may be done again.
    """

    back: float = 0.1
    farther: float = 0.7
    skip: float = 0.001
    change: float = 0.05
    retries: int = 2


class LearnedRouter:
    """A router with the routing network.

    Args:
        model: the networks.
        odds: of going back, skipping, and changing demonstrations.
    """

    def __init__(self, model: Model, odds: Odds | None = None):
        self._model, self._odds = model, odds or Odds()
        self._shown: list[Described] = []
        self.reset()

    def watch(self, steps: Sequence[Transition]) -> None:
        """Describe the states of a further demonstration."""
        states = self._states([step.before for step in steps], list(range(len(steps))))
        with torch.inference_mode():
            self._shown.append(self._model.routing.describe(states))

    def reset(self) -> None:
        """Begin with the first step, of any demonstration."""
        self._last: tuple[int, int] | None = None
        self._taken: Counter[tuple[int, int]] = Counter()

    def route(self, query: Scene) -> tuple[int, int]:
        """The demonstration and step with the largest product of odds and probability."""
        scores = self.scores(query)
        posterior = [np.log(self._prior(n, len(seen))) + seen for n, seen in enumerate(scores)]
        number = int(np.argmax([p.max() for p in posterior]))
        return number, int(posterior[number].argmax())

    def took(self, demonstration: int, step: int) -> None:
        """The following step is expected next."""
        self._last = demonstration, step
        self._taken[self._last] += 1

    def scores(self, query: Scene) -> list[FloatArray]:
        """For each demonstration (L,) logarithms of its steps' probabilities, without what is expected."""
        found = []
        with torch.inference_mode():
            asked = self._model.routing.describe(self._states([query], [UNKNOWN]))
            for shown in self._shown:
                one = torch.zeros(len(shown.robot), dtype=torch.int64)
                scores, _ = self._model.routing.score(shown, one, asked, one[:1])
                found.append(scores[0].double().numpy())
        return found

    def _prior(self, number: int, length: int) -> FloatArray:
        """(L,) odds of the steps of a demonstration."""
        odds, steps = self._odds, np.arange(length)
        followed, last = self._last or (number, -1)
        expected = min(last + 1, length - 1)
        back = odds.back * odds.farther ** np.maximum(expected - steps - 1, 0)
        prior = np.where(steps < expected, back, np.where(steps > expected, odds.skip, 1.0))
        worn = np.array([self._taken[number, int(step)] > odds.retries for step in steps])
        prior[worn & (steps != expected)] = 1e-12
        return prior * (1.0 if number == followed else odds.change)

    def _states(self, scenes: Sequence[Scene], steps: Sequence[float]) -> States:
        seen = [scene.observation for scene in scenes]
        poses = np.stack([observation.T_world_gripper for observation in seen])
        opening = [observation.gripper_opening for observation in seen]
        graphs = [build_graph(scene.cloud, self._model.config.route_graph, scene.ground) for scene in scenes]
        return make_states(graphs, poses, opening, steps)
