"""Which demonstrated step the present state corresponds to.

`AdvancingRouter` takes one step after the other. `LearnedRouter` weighs what the routing network says of what
is seen with what was done so far. The network is told which step comes
next if every action so far did what was demonstrated, and sees what the last action changed. What else the
episode says enters as odds:

- the step after the one taken last: 1;
- a step before that, since an action can fail: `back`;
- any step after it, since what a step would do may be done already: `skip`;
- the same in another demonstration than the one followed so far: times `change`.

The product of odds and the network's probability decides. A step that was taken 1 + `retries` times is only
taken again where it is the expected one, so that an episode goes on.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import torch

from imop.networks.changes import change_graph, compared
from imop.networks.model import Model
from imop.networks.routing import Described, States, make_states
from imop.policy.interfaces import Scene, Transition
from imop.types import FloatArray, Observation

# Fingers that are open by less than this share of their stroke hold nothing.
EMPTY = 0.01


class Router(Protocol):
    """Chooses a demonstration and one of its steps."""

    def watch(self, steps: Sequence[Transition]) -> None:
        """Take note of a further demonstration."""
        ...

    def reset(self) -> None:
        """A new episode begins."""
        ...

    def route(self, query: Scene) -> tuple[int, int]:
        """Number of the demonstration and of its step that fit the query; asking changes nothing."""
        ...

    def took(self, demonstration: int, step: int) -> None:
        """The step was found in the scene and its action is being performed."""
        ...

    def undo(self) -> None:
        """The action of the step taken last was not carried out: the step before it was the last one."""
        ...


class AdvancingRouter:
    """Goes through the first demonstration step by step and then stays at its last.

    It goes back to the approach if the hand is empty that held something in the demonstration.
    """

    def __init__(self) -> None:
        self._steps: list[Transition] = []
        self.reset()

    def watch(self, steps: Sequence[Transition]) -> None:
        """Remember the first demonstration."""
        self._steps = self._steps or list(steps)

    def reset(self) -> None:
        """Begin with the first step."""
        self._before = self._next = 0

    def route(self, query: Scene) -> tuple[int, int]:
        """The step after the one taken last, or the approach to what was lost."""
        lost = self._next > 0 and _is_empty(query.observation, self._steps[self._next].before.observation)
        return 0, _approach(self._steps, self._next) if lost else self._next

    def took(self, demonstration: int, step: int) -> None:
        """The following step is next."""
        self._before, self._next = step, min(step + 1, len(self._steps) - 1)

    def undo(self) -> None:
        """The step taken last is next."""
        self._next = self._before


def _is_empty(observed: Observation, shown: Observation) -> bool:
    """Whether the fingers closed on nothing, where they held something when it was shown."""
    return observed.gripper_opening < EMPTY and shown.gripper_opening > 2 * EMPTY


def _approach(steps: Sequence[Transition], step: int) -> int:
    """The last step before one (other than the first) that comes to a thing with the hand open."""
    opened = [k for k in range(step) if steps[k].action.gripper_open]
    return opened[-1] if opened else 0


@dataclass(frozen=True)
class Odds:
    """How likely the steps are before anything is seen, against the expected one.

    Attributes:
        back: of a step before.
        skip: of a later step.
        change: of another demonstration than the one followed so far.
        retries: how often a step may be done again.
    """

    back: float = 0.2
    skip: float = 0.01
    change: float = 0.05
    retries: int = 2


def prior(odds: Odds, expected: int, length: int) -> FloatArray:
    """(length,) odds of the steps of a demonstration if step `expected`, or none any more, comes next."""
    ahead = np.arange(length) - min(expected, length - 1)
    return np.where(ahead < 0, odds.back, np.where(ahead > 0, odds.skip, 1.0))


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
        scenes = [step.before for step in steps]
        with torch.inference_mode():
            described = self._model.routing.describe(self._states(scenes, [scenes[0], *scenes[:-1]]))
        self._shown.append(described)

    def reset(self) -> None:
        """Begin with the first step, of any demonstration."""
        self._last: tuple[int, int] | None = None
        self._asked: Scene | None = None
        self._before: Scene | None = None
        self._undone: tuple[tuple[int, int] | None, Scene | None] = None, None
        self._taken: Counter[tuple[int, int]] = Counter()

    def route(self, query: Scene) -> tuple[int, int]:
        """The demonstration and step with the largest product of odds and probability."""
        self._asked = query
        scores = self.scores(query)
        posterior = [np.log(self._prior(n, len(seen))) + seen for n, seen in enumerate(scores)]
        number = int(np.argmax([p.max() for p in posterior]))
        return number, int(posterior[number].argmax())

    def took(self, demonstration: int, step: int) -> None:
        """The following step is expected next, and what was asked about last is the state before it."""
        self._undone = self._last, self._before
        self._last, self._before = (demonstration, step), self._asked
        self._taken[self._last] += 1

    def undo(self) -> None:
        """The step before that taken last is the last one again."""
        self._last, self._before = self._undone

    def scores(self, query: Scene) -> list[FloatArray]:
        """For each demonstration (L,) logarithms of its steps' probabilities."""
        found = []
        with torch.inference_mode():
            asked = self._model.routing.describe(self._states([query], [self._before or query]))
            for shown in self._shown:
                one = torch.zeros(len(shown.robot), dtype=torch.int64)
                expected = torch.tensor([min(self._expected, len(one))])
                scores, _ = self._model.routing.score(shown, one, asked, one[:1], expected)
                found.append(scores[0].double().numpy())
        return found

    @property
    def _expected(self) -> int:
        return 0 if self._last is None else self._last[1] + 1

    def _prior(self, number: int, length: int) -> FloatArray:
        """(L,) odds of the steps of a demonstration in the episode so far."""
        odds, expected = self._odds, self._expected
        steps = prior(odds, expected, length)
        worn = np.array([self._taken[number, step] > odds.retries for step in range(length)])
        worn[min(expected, length - 1)] = False
        steps[worn] = 1e-12
        followed = number if self._last is None else self._last[0]
        return steps * (1.0 if number == followed else odds.change)

    def _states(self, scenes: Sequence[Scene], before: Sequence[Scene]) -> States:
        """States of what is seen, each with what was seen before it."""
        clouds = {id(scene): compared(scene.cloud, scene.ground) for scene in (*scenes, *before)}
        config = self._model.config.route_graph
        pairs = list(zip(scenes, before, strict=True))
        looks = [change_graph(clouds[id(now)], clouds[id(last)], config) for now, last in pairs]
        seen = [[scene.observation for scene in pair] for pair in pairs]
        poses = np.array([[o.T_world_gripper for o in pair] for pair in seen])
        opening = np.array([[o.gripper_opening for o in pair] for pair in seen])
        return make_states(looks, poses, opening)
