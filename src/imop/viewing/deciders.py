"""Who decides what is done next, and shows why: a one-shot policy, or anything that only says what to do."""

import inspect
from typing import Protocol

from imop.errors import InvalidInput, NoConfidentMatch
from imop.evaluation.methods import Policy
from imop.geometry.focus import Focus
from imop.geometry.perception import Perception
from imop.policy.interfaces import Scene
from imop.policy.one_shot import Decision, OneShotPolicy
from imop.types import Action, Demonstration, Observation
from imop.viewing.look import Look, Shown

MOST = 8
"""So many candidates are looked at."""


class Decider(Protocol):
    """Decides, and waits for somebody to agree."""

    def reset(self) -> None:
        """A new episode begins."""
        ...

    def decide(self, observation: Observation, focus: Focus | None = None) -> Look:
        """What might be done now, likeliest first; asked again before `take`, it decides anew.

        Raises:
            ImopError: if the observation cannot be used, or nobody can be told the focus.
        """
        ...

    def take(self, number: int) -> None:
        """The choice of that number, of what was decided last, is being performed."""
        ...


class PolicyDecider:
    """A one-shot policy that has watched its demonstrations.

    Args:
        policy: the policy.
        most: so many candidates are choices.
        recovers: whether steps that came to nothing are tried again; not in a recording, where the arm is
            elsewhere than it was sent.
    """

    def __init__(self, policy: OneShotPolicy, most: int = MOST, recovers: bool = False) -> None:
        policy.recovers = recovers
        self._policy, self._most = policy, most
        self._decision: Decision | None = None

    def reset(self) -> None:
        """A new episode begins."""
        self._decision = None
        self._policy.reset()

    def decide(self, observation: Observation, focus: Focus | None = None) -> Look:
        """What the policy would do, its other candidates, and what it knows of the demonstrated step."""
        self._decision = None
        try:
            decision = self._policy.decide(observation, focus)
        except NoConfidentMatch as error:
            return Look(self._policy.see(observation, focus), problem=str(error))
        self._decision = decision
        count = min(len(decision.candidates), self._most)
        others = [self._policy.instead(decision, number).action for number in range(1, count)]
        steps, step = self._policy.steps(decision.option.demonstration), decision.option.step
        transition, prepared = steps[step]
        actions = tuple(one.action for one, _ in steps)
        shown = Shown(step, transition.before, actions, prepared.spread)
        return Look(decision.query, (decision.action, *others), shown)

    def take(self, number: int) -> None:
        """The episode goes on from that choice."""
        assert self._decision is not None, "decide comes before take"
        self._policy.take(self._policy.instead(self._decision, number))


class ActingDecider:
    """Anything that has `watch`, `reset` and `act`: a client of `imop serve`, a method of one's own.

    There is one choice. What it was asked it counts as done, so it can be asked again only at the beginning
    of an episode, which then begins anew.

    Args:
        policy: has watched the demonstration; it is told a focus if its `act` takes one.
        demonstration: the same, to be shown.
        perception: makes the clouds that are shown.
    """

    def __init__(self, policy: Policy, demonstration: Demonstration, perception: Perception) -> None:
        self._policy, self._demonstration, self._perception = policy, demonstration, perception
        self._told = "focus" in inspect.signature(policy.act).parameters
        self._taken, self._waiting = 0, False

    def reset(self) -> None:
        """A new episode begins."""
        self._taken, self._waiting = 0, False
        self._policy.reset()

    def decide(self, observation: Observation, focus: Focus | None = None) -> Look:
        """What it would do, with its match if it tells one.

        Raises:
            InvalidInput: if it cannot be told a focus, or is asked again after the first step.
            ImopError: as its `act` does.
        """
        if focus is not None and not self._told:
            raise InvalidInput("focus", "this method cannot be told what is meant", "a one-shot policy here")
        if self._waiting and self._taken:
            problem = "this method counts what it was asked as done, so it cannot be asked again"
            raise InvalidInput("look", problem, "to accept, or a new episode")
        if self._waiting:
            self._policy.reset()
        scene = Scene(observation, self._perception.points(observation))
        try:
            action = self._policy.act(observation, **({} if focus is None else {"focus": focus}))
        except NoConfidentMatch as error:
            return Look(scene, problem=str(error))
        self._waiting = True
        return Look(scene, (action,), self._shown(action))

    def take(self, number: int) -> None:
        """It was counted when it was asked."""
        self._taken, self._waiting = self._taken + 1, False

    def _shown(self, action: Action) -> Shown | None:
        if action.match is None:
            return None
        steps = self._demonstration.keyframes
        before = steps[action.match.step].observation
        actions = tuple(step.action for step in steps)
        return Shown(action.match.step, Scene(before, self._perception.points(before)), actions)
