"""The policy: watch a demonstration once, then act in scenes that were never seen."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from imop.errors import CorruptData, InvalidInput, NoConfidentMatch
from imop.geometry.perception import Perception
from imop.geometry.view_alignment import corrected, find_errors
from imop.networks.model import BUNDLED, load_model
from imop.policy.hypotheses import confidence
from imop.policy.learned import LearnedMatcher
from imop.policy.matcher import Hypothesis, Matcher, PreparedStep, Scene, Transition
from imop.policy.router import AdvancingRouter, LearnedRouter, Router
from imop.types import Action, Demonstration, FloatArray, Match, Observation

Feasible = Callable[[FloatArray], bool]

# A hypothesis with this share of the best one's score may take its place if the arm cannot go there.
INSTEAD = 0.8


class OneShotPolicy:
    """Transfers demonstrated poses by finding each step's region again: T_j = T_query_support T_i.

    Args:
        matcher: finds the regions.
        perception: makes clouds of observations.
        router: chooses the demonstrated step; by default they follow each other. It may be replaced before
            anything is watched.
        min_confidence: below it `act` raises `NoConfidentMatch`; 0 acts always.
        feasible: whether the arm can take the gripper to T_world_gripper (4, 4); of poses that are about as
            right, the first feasible one is taken.

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
        self._feasible = feasible or (lambda T_world_gripper: True)
        self._demonstrations: list[list[Transition]] = []
        self._prepared: list[list[PreparedStep]] = []
        self._cameras: set[str] = set()
        self._camera_errors: dict[str, FloatArray] = {}
        self._hints: list[FloatArray] = []

    @classmethod
    def from_pretrained(
        cls,
        weights: Path = BUNDLED,
        perception: Perception | None = None,
        min_confidence: float = 0.0,
        routed: bool = False,
        feasible: Feasible | None = None,
    ) -> "OneShotPolicy":
        """The learned policy.

        Args:
            weights: folder with weights and card, as `imop train` writes it; by default the bundled ones.
            perception: makes clouds of observations; by default the robot stays in them.
            min_confidence: below it `act` raises `NoConfidentMatch`.
            routed: whether the routing network chooses the step, so that what failed is repeated; otherwise
                steps follow each other.
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
        router = LearnedRouter(model) if routed else None
        return cls(LearnedMatcher(model), perception or Perception(), router, min_confidence, feasible)

    def watch(self, demonstration: Demonstration) -> None:
        """Take in a demonstration; a further call adds another one.

        Raises:
            InvalidInput: if an observation has no usable depth.
        """
        observations = [keyframe.observation for keyframe in demonstration.keyframes]
        seen = [*observations, demonstration.final]
        if self._perception.align_views:
            # One set-up has one calibration: all that is shown tells of it.
            self._camera_errors |= find_errors(seen, self._camera_errors)
        scenes = [self._scene(observation) for observation in seen]
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
        self._hints = []
        self.router.reset()

    def act(self, observation: Observation) -> Action:
        """The action for what is seen now, with its confidence and the matched points.

        Raises:
            InvalidInput: if nothing was watched, a camera of the demonstration is missing, or no depth was
                measured.
            NoConfidentMatch: if the confidence is below `min_confidence`.
        """
        if not self._demonstrations:
            raise InvalidInput("demonstration", "none was watched", "call watch(demonstration) before act")
        if missing := sorted(self._cameras - set(observation.views)):
            raise InvalidInput(
                "views", f"camera {missing[0]} is missing", f"all of {', '.join(sorted(self._cameras))}"
            )
        query = self._scene(observation)
        number, step = self.router.route(query)
        demonstrated = self._demonstrations[number][step].action
        prepared = self._prepared[number][step]
        hypotheses = prepared.match(query, self._hints)
        trust = confidence(hypotheses, demonstrated.T_world_gripper)
        if trust < self._min_confidence or not hypotheses:
            raise NoConfidentMatch(trust, self._min_confidence)
        self.router.took(number, step)
        best = self._chosen(hypotheses, demonstrated.T_world_gripper)
        self._hints = [best.T_query_support]
        T_world_gripper = _orthonormal(best.T_query_support @ demonstrated.T_world_gripper)
        match = Match(step, best.p_support, best.p_query, prepared.region)
        return Action(T_world_gripper, demonstrated.gripper_open, demonstrated.allow_collisions, trust, match)

    def _chosen(self, hypotheses: Sequence[Hypothesis], T_demonstrated: FloatArray) -> Hypothesis:
        """The first that the arm can follow among those about as good as the best; else the best."""
        good = [h for h in hypotheses if h.score >= INSTEAD * hypotheses[0].score]
        able = (h for h in good if self._feasible(_orthonormal(h.T_query_support @ T_demonstrated)))
        return next(able, hypotheses[0])

    def _scene(self, observation: Observation) -> Scene:
        if self._perception.align_views:
            # A camera may have been knocked since; else the errors stay as they are.
            observation = corrected(observation, find_errors([observation], self._camera_errors))
        return Scene(observation, self._perception.points(observation))


def _orthonormal(T: FloatArray) -> FloatArray:
    """The pose with rounding errors of its rotation removed."""
    U, _, Vh = np.linalg.svd(T[:3, :3])
    clean = T.copy()
    clean[:3, :3] = U @ Vh
    return clean
