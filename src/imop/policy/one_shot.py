"""The policy: watch a demonstration once, then act in scenes that were never seen."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from imop.errors import CorruptData, InvalidInput, NoConfidentMatch
from imop.geometry.focus import Focus, in_focus
from imop.geometry.memory import with_hidden
from imop.geometry.perception import Perception
from imop.geometry.view_alignment import corrected, find_errors
from imop.networks.model import BUNDLED, load_model
from imop.policy.decision import Decision, transferred
from imop.policy.interfaces import (
    BEGINNING,
    Candidate,
    Feasible,
    Matcher,
    PreparedStep,
    Progress,
    Scene,
    Transition,
)
from imop.policy.learned import LearnedMatcher
from imop.policy.recovery import Attempts, same_place
from imop.policy.router import AdvancingRouter, LearnedRouter, Option, Router, holds
from imop.types import Action, Demonstration, FloatArray, Observation


class OneShotPolicy:
    """Transfers demonstrated poses by finding each step's region again: T_j = T_query_support T_i.

    Args:
        matcher: finds the regions.
        perception: makes clouds of observations.
        router: chooses the demonstrated step; by default they follow each other. It may be replaced before
            anything is watched.
        min_confidence: below it `act` raises `NoConfidentMatch`; 0 acts always.
        feasible: whether the arm can take the gripper to T_world_gripper (4, 4); the likeliest candidate that
            it can follow is taken. If it can follow none, the action says so (`Action.reachable`).

    Raises:
        InvalidInput: for a `min_confidence` out of its range.
    """

    def __init__(
        self,
        matcher: Matcher,
        perception: Perception,
        router: Router | None = None,
        min_confidence: float = 0.0,
        feasible: Feasible | None = None,
    ):
        if not 0.0 <= min_confidence <= 1.0:
            raise InvalidInput("min_confidence", f"{min_confidence}", "a number from 0 to 1")
        self._matcher = matcher
        self._perception = perception
        self.router = router or AdvancingRouter()
        self._min_confidence = min_confidence
        self._feasible = feasible
        self._demonstrations: list[list[Transition]] = []
        self._prepared: list[list[PreparedStep]] = []
        self._cameras: set[str] = set()
        self._camera_errors: dict[str, FloatArray] = {}
        self._progress: dict[int, Progress] = {}
        self._before = self._progress
        self._last: Scene | None = None
        self.recovers = False
        """Whether steps that came to nothing are tried again (`recovery.py`); may be set between episodes."""
        self._attempts = Attempts()

    @classmethod
    def from_pretrained(
        cls,
        weights: Path = BUNDLED,
        perception: Perception | None = None,
        min_confidence: float = 0.0,
        routed: bool | None = None,
        feasible: Feasible | None = None,
    ) -> "OneShotPolicy":
        """The learned policy.

        Args:
            weights: folder with weights and card, as `imop train` writes it; by default the bundled ones.
            perception: makes clouds of observations; by default the robot stays in them.
            min_confidence: below it `act` raises `NoConfidentMatch`.
            routed: whether the routing network chooses the step, so that what failed is repeated; otherwise
                steps follow each other. By default it does if it is trained.
            feasible: whether the arm can take the gripper to a pose.

        Raises:
            CorruptData: if the weights are missing, damaged, do not fit their card, or are not trained for
                routing though it is wanted.
        """
        model = load_model(weights)
        if routed and not model.routing.trained:
            raise CorruptData(
                weights, "has no trained routing network", "merge one into it (docs/training.md)"
            )
        chosen = model.routing.trained if routed is None else routed
        router = LearnedRouter(model) if chosen else None
        return cls(LearnedMatcher(model), perception or Perception(), router, min_confidence, feasible)

    def watch(self, demonstration: Demonstration, focus: Focus | None = None) -> None:
        """Take in a demonstration; a further call adds another one.

        An episode fails at its weakest step. So of several demonstrations the policy follows the one whose
        least probable step is the most probable.

        Args:
            demonstration: what was shown.
            focus: the thing in the first observation that is acted on first, if somebody says so; it is
                what the steps until the gripper closes refer to.

        Raises:
            InvalidInput: if an observation has no usable depth, or the focus does not fit it.
        """
        observations = [keyframe.observation for keyframe in demonstration.keyframes]
        seen = [*observations, demonstration.final]
        if self._perception.align_views:
            # One set-up has one calibration: all that is shown tells of it.
            self._camera_errors |= find_errors(seen, self._camera_errors)
        scenes = [self._scene(corrected(observation, self._camera_errors)) for observation in seen]
        if focus is not None:
            scenes = _focused(scenes, demonstration, focus)
        steps = [
            Transition(before, after, keyframe.action)
            for before, after, keyframe in zip(scenes, scenes[1:], demonstration.keyframes, strict=False)
        ]
        self._cameras |= set(observations[0].views)
        self._demonstrations.append(steps)
        self._prepared.append(list(self._matcher.prepare(steps)))
        self.router.watch(steps)

    def reset(self) -> None:
        """Begin a new episode."""
        self._progress, self._before = {}, {}
        self._last, self._attempts = None, Attempts()
        self.router.reset()

    def act(self, observation: Observation, focus: Focus | None = None) -> Action:
        """The action for what is seen now, with its confidence and the matched points.

        With `recovers`, a step is tried elsewhere if the arm is not where it was sent. It is done again if
        the thing that it led to has been moved since.

        Args:
            observation: what is seen.
            focus: which thing is meant, if a person, a detector or a click says so: what lies outside is no
                candidate for what this step acts on.

        Raises:
            InvalidInput: if nothing was watched, a camera of the demonstration is missing, no depth was
                measured, or the focus does not fit the observation.
            NoConfidentMatch: if the confidence is below `min_confidence`.
        """
        decision = self.decide(observation, focus)
        self.take(decision)
        return decision.action

    def decide(self, observation: Observation, focus: Focus | None = None) -> Decision:
        """What `act` would do now, and its other candidates. Nothing is done until `take` is called.

        Raises:
            InvalidInput, NoConfidentMatch: as `act`.
        """
        if not self._demonstrations:
            raise InvalidInput("demonstration", "none was watched", "call watch(demonstration) before act")
        if missing := sorted(self._cameras - set(observation.views)):
            raise InvalidInput(
                "views", f"camera {missing[0]} is missing", f"all of {', '.join(sorted(self._cameras))}"
            )
        query = self.see(observation, focus, self._last)
        if self.recovers and not self._attempts.arrived(observation):
            self.router.undo()
            self._progress = self._before
        decision = self._likeliest(query, self.router.options(query))
        return self._checked(decision) if self.recovers else decision

    def instead(self, decision: Decision, number: int) -> Decision:
        """The same decision for the candidate of that number.

        Raises:
            InvalidInput: if there is none of that number.
        """
        if not 0 <= number < len(decision.candidates):
            raise InvalidInput("number", f"{number}", f"0 .. {len(decision.candidates) - 1}")
        option, candidate = decision.option, decision.candidates[number]
        return replace(decision, action=self._transferred(decision.query, option, candidate))

    def take(self, decision: Decision) -> None:
        """Let the episode go on from the decision, whose action is being performed."""
        option, action = decision.option, decision.action
        self.router.took(option.demonstration, option.step)
        self._attempts.took(option, action.T_world_gripper)
        assert action.match is not None and action.match.T_query_support is not None
        self._before = self._progress
        self._progress = {option.demonstration: Progress(action.match.T_query_support)}
        self._last = decision.query

    def _likeliest(self, query: Scene, options: Sequence[Option]) -> Decision:
        """The step that is most plausible and most likely found.

        Raises:
            NoConfidentMatch: if none is found with enough confidence.
        """
        found: list[tuple[float, Decision]] = []
        failure = NoConfidentMatch(0.0, self._min_confidence)
        for option in options:
            # What was done before was another motion in the scene of another demonstration.
            progress = self._progress.get(option.demonstration, BEGINNING)
            tried = self._attempts.go_on(option)
            try:
                decision = self._decision(query, option, replace(progress, tried=tried))
            except NoConfidentMatch as error:
                failure = error
                continue
            # A demonstration that is followed alone need not be weighed.
            chance = self._weakest(decision) if len(options) > 1 else 1.0
            found.append((option.weight * chance, decision))
        if not found:
            raise failure
        return max(found, key=lambda one: one[0])[1]

    def _weakest(self, decision: Decision) -> float:
        """The probability of the least probable of all places that a demonstration has yet to come to."""
        number = decision.option.demonstration
        places = enumerate(same_place(self._prepared[number]))
        later = [k for k, same in places if k > decision.option.step and not same]
        chances = [decision.action.confidence]
        for step in later:
            candidates = self._prepared[number][step].locate(decision.query, BEGINNING, self._feasible)
            chances.append(candidates[0].probability if candidates else 0.0)
        return min(chances)

    def _checked(self, decision: Decision) -> Decision:
        """The same, or one for the step before, if what that acted on is not where it was."""
        option = decision.option
        number, step = option.demonstration, option.step
        last, steps = self._progress.get(number, BEGINNING).T_last, self._demonstrations[number]
        same = step > 0 and same_place(self._prepared[number][step - 1 : step + 1])[1]
        if last is None or not same or holds(steps)[step - 1]:
            return decision
        T_held = last @ steps[step].action.T_world_gripper
        if not self._attempts.undone(option, decision.action.T_world_gripper, T_held):
            return decision
        # Where it is now, nothing that was done before tells.
        return self._decision(decision.query, replace(option, step=step - 1), BEGINNING)

    def see(
        self, observation: Observation, focus: Focus | None = None, earlier: Scene | None = None
    ) -> Scene:
        """The scene that the policy works on: views brought together and fused, without the robot.

        Args:
            observation: what is seen.
            focus: which thing is meant, if somebody says so.
            earlier: what was seen before in this episode: of what is hidden now, it tells where it was.

        Raises:
            InvalidInput: if no depth was measured, or the focus does not fit the observation.
        """
        if self._perception.align_views:
            # A camera may have been knocked since; else the errors stay as they are.
            observation = corrected(observation, find_errors([observation], self._camera_errors))
        return self._scene(observation, focus, earlier)

    def _scene(
        self, observation: Observation, focus: Focus | None = None, earlier: Scene | None = None
    ) -> Scene:
        cloud = self._perception.points(observation)
        if earlier is not None:
            way = np.stack([o.T_world_gripper[:3, 3] for o in (earlier.observation, observation)])
            stood = earlier.fused.select(~earlier.ground.bare)
            cloud = with_hidden(cloud, observation, stood, way, self._perception.robot_mask)
        return Scene(observation, cloud, None if focus is None else in_focus(focus, observation, cloud))

    def locate(
        self, query: Scene, step: int, demonstration: int = 0, progress: Progress = BEGINNING
    ) -> Action:
        """The action of a demonstrated step in a scene; asking changes nothing.

        Args:
            query: the scene, from `see`.
            step: of the demonstration.
            demonstration: number of it, in the order in which they were watched.
            progress: of the episode.

        Raises:
            NoConfidentMatch: if the confidence is below `min_confidence`, or nothing was found.
        """
        return self._decision(query, Option(demonstration, step), progress).action

    def steps(self, demonstration: int = 0) -> tuple[tuple[Transition, PreparedStep], ...]:
        """The steps of a demonstration as the policy sees them, and what it found of each, to look at.

        Raises:
            InvalidInput: if no demonstration of that number was watched.
        """
        if not 0 <= demonstration < len(self._demonstrations):
            watched = f"a number below {len(self._demonstrations)}, for so many were watched"
            raise InvalidInput("demonstration", f"{demonstration}", watched)
        return tuple(zip(self._demonstrations[demonstration], self._prepared[demonstration], strict=True))

    def _decision(self, query: Scene, option: Option, progress: Progress) -> Decision:
        """For a step, by its likeliest candidate.

        Raises:
            NoConfidentMatch: if the confidence is below `min_confidence`, or nothing was found.
        """
        prepared = self._prepared[option.demonstration][option.step]
        candidates = prepared.locate(query, progress, self._feasible)
        if not candidates or candidates[0].probability < self._min_confidence:
            probability = candidates[0].probability if candidates else 0.0
            raise NoConfidentMatch(probability, self._min_confidence)
        return Decision(option, query, candidates, self._transferred(query, option, candidates[0]))

    def _transferred(self, query: Scene, option: Option, candidate: Candidate) -> Action:
        shown = self._demonstrations[option.demonstration][option.step]
        region = self._prepared[option.demonstration][option.step].region
        return transferred(shown, option.step, region, query, candidate)


def _focused(scenes: Sequence[Scene], demonstration: Demonstration, focus: Focus) -> list[Scene]:
    """The scenes, of which those until the gripper closes are focused on what is meant in the first."""
    first = scenes[0]
    meant = Focus(points=first.fused.points[in_focus(focus, first.observation, first.fused)])
    return [
        replace(scene, focus=in_focus(meant, scene.observation, scene.fused))
        if k <= demonstration.closing
        else scene
        for k, scene in enumerate(scenes)
    ]
