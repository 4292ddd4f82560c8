"""Which demonstrated step the present state corresponds to.

`AdvancingRouter` takes one step after the other. `LearnedRouter` weighs what the routing network says with
what was done so far. The network is told which step comes next if every action so far did what was
demonstrated, and sees what the last action changed. Everything else that the episode says enters as odds:

- the step after the one taken last: 1;
- a step before that, since an action can fail: `back`;
- any step after it, since what a step would do may be done already: `skip`;
- what was done with something in the hand, if the fingers are closed on nothing: times `lost`;
- the same in another demonstration than the one followed so far: times `change`, unless that one failed.

The product of odds and the network's probability decides. A step that was taken 1 + `retries` times is only
taken again where it is the expected one, so that an episode goes on. Of several demonstrations both routers
name those that are about as plausible; which one it is the policy decides by how well each is found again.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import torch

from imop.networks.changes import change_graph, compared
from imop.networks.model import Model
from imop.networks.routing import Described, States, make_states
from imop.policy.interfaces import Scene, Transition
from imop.types import BoolArray, FloatArray

# Fingers that are open by less than this share of their stroke hold nothing; by more, they do if they close.
# The first is what a closed gripper's opening may err by, the second twice that; neither was tuned.
EMPTY, HELD = 0.01, 0.02

# Of several demonstrations those are options that are at least so plausible, against the most plausible one.
# Not tuned: it saves searches where one is clearly followed.
PLAUSIBLE = 0.1


@dataclass(frozen=True)
class Option:
    """A step that may come now.

    Attributes:
        demonstration, step: its numbers.
        weight: how plausible it is, against other options.
    """

    demonstration: int
    step: int
    weight: float = 1.0


class Router(Protocol):
    """Chooses steps of demonstrations."""

    def watch(self, steps: Sequence[Transition]) -> None:
        """Take note of a further demonstration."""
        ...

    def reset(self) -> None:
        """A new episode begins."""
        ...

    def options(self, query: Scene) -> tuple[Option, ...]:
        """Steps that may come now, at most one of each demonstration; asking changes nothing."""
        ...

    def took(self, demonstration: int, step: int) -> None:
        """The step was found in the scene and its action is being performed."""
        ...

    def undo(self) -> None:
        """The action of the step taken last was not carried out: the step before it was the last one."""
        ...


class AdvancingRouter:
    """Goes through one demonstration step by step and then stays at its last.

    Of several demonstrations, the first step decides which one it follows.
    """

    def __init__(self) -> None:
        self._lengths: list[int] = []
        self.reset()

    def watch(self, steps: Sequence[Transition]) -> None:
        """Remember how many steps a demonstration has."""
        self._lengths.append(len(steps))

    def reset(self) -> None:
        """Begin with the first step, of any demonstration."""
        self._last: tuple[int, int] | None = None
        self._undone: tuple[int, int] | None = None

    def options(self, query: Scene) -> tuple[Option, ...]:
        """The step after the one taken last."""
        if self._last is None:
            return tuple(Option(number, 0) for number in range(len(self._lengths)))
        number, step = self._last
        return (Option(number, min(step + 1, self._lengths[number] - 1)),)

    def took(self, demonstration: int, step: int) -> None:
        """The following step is next."""
        self._undone, self._last = self._last, (demonstration, step)

    def undo(self) -> None:
        """The step taken last is next."""
        self._last = self._undone


def holds(steps: Sequence[Transition]) -> BoolArray:
    """(L,) whether something is in the hand after each demonstrated step.

    The state before the hand opens again tells it, since fingers may still be closing at a keyframe.
    """
    held, opening = np.zeros(len(steps), dtype=bool), 0.0
    for k in reversed(range(len(steps))):
        last = k + 1 == len(steps) or steps[k + 1].action.gripper_open
        opening = steps[k].after.observation.gripper_opening if last else opening
        held[k] = not steps[k].action.gripper_open and opening > HELD
    return held


@dataclass(frozen=True)
class Odds:
    """How likely the steps are before anything is seen, against the expected one.

    Attributes:
        back: of a step before.
        skip: of a later step.
        change: of another demonstration than the one followed so far.
        lost: of a step before which something was in the hand, if the fingers are closed on nothing.
        retries: how often a step may be done again.
    """

    back: float = 0.2
    skip: float = 0.01
    change: float = 0.05
    lost: float = 0.01
    retries: int = 2


def prior(odds: Odds, expected: int, length: int) -> FloatArray:
    """(length,) odds of the steps of a demonstration if step `expected`, or none any more, comes next."""
    ahead = np.arange(length) - min(expected, length - 1)
    return np.where(ahead < 0, odds.back, np.where(ahead > 0, odds.skip, 1.0))


def _normalized(scores: FloatArray) -> FloatArray:
    """(L,) probabilities, from their logarithms up to a constant."""
    p = np.exp(scores - scores.max())
    return np.asarray(p / p.sum())


class LearnedRouter:
    """A router with the routing network.

    Args:
        model: the networks.
        odds: of going back, skipping, and changing demonstrations.
    """

    def __init__(self, model: Model, odds: Odds | None = None):
        self._model, self._odds = model, odds or Odds()
        self._shown: list[Described] = []
        self._needs_hold: list[BoolArray] = []  # before which steps something is in the hand
        self.reset()

    def watch(self, steps: Sequence[Transition]) -> None:
        """Describe the states of a further demonstration."""
        scenes = [step.before for step in steps]
        with torch.inference_mode():
            described = self._model.routing.describe(self._states(scenes, [scenes[0], *scenes[:-1]]))
        self._shown.append(described)
        self._needs_hold.append(np.r_[False, holds(steps)[:-1]])

    def reset(self) -> None:
        """Begin with the first step, of any demonstration."""
        self._last: tuple[int, int] | None = None
        self._asked: Scene | None = None
        self._first: dict[tuple[int, int], Scene | None] = {}
        self._before: Scene | None = None
        self._undone: tuple[tuple[int, int] | None, Scene | None] = None, None
        self._taken: Counter[tuple[int, int]] = Counter()

    def options(self, query: Scene) -> tuple[Option, ...]:
        """The step with the largest product of odds and probability, of every plausible demonstration."""
        self._asked = query
        scores = self.scores(query)
        chances = [self._prior(len(seen)) * _normalized(seen) for seen in scores]
        for number, chance in enumerate(chances):
            if query.observation.gripper_opening < EMPTY:
                chance[self._needs_hold[number]] *= self._odds.lost
            chance[self._worn(number, len(chance))] *= 1e-12
        found = [Option(n, int(chance.argmax()), float(chance.max())) for n, chance in enumerate(chances)]
        return tuple(self._plausible(found))

    def _plausible(self, options: Sequence[Option]) -> list[Option]:
        """Those of the demonstration that is followed, and of others if it failed."""
        if self._last is not None:
            followed, last = self._last
            failed = options[followed].step <= last
            change = 1.0 if failed else self._odds.change
            options = [
                o if o.demonstration == followed else replace(o, weight=change * o.weight) for o in options
            ]
        best = max(option.weight for option in options)
        return [option for option in options if option.weight >= PLAUSIBLE * best]

    def took(self, demonstration: int, step: int) -> None:
        """The following step is expected next, and what was asked about last is the state before it."""
        self._undone = self._last, self._before
        self._last = (demonstration, step)
        # What is done again has the state before it that it had at first: the network knows no other.
        self._before = self._first.setdefault(self._last, self._asked)
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

    def _prior(self, length: int) -> FloatArray:
        """(L,) odds of the steps of a demonstration in the episode so far."""
        return prior(self._odds, self._expected, length)

    def _worn(self, number: int, length: int) -> BoolArray:
        """(L,) which steps of a demonstration were taken too often; never the one that is expected."""
        worn = np.array([self._taken[number, step] > self._odds.retries for step in range(length)])
        worn[min(self._expected, length - 1)] = False
        return worn

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
