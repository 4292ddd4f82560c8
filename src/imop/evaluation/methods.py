"""Policies by the names of their methods."""

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Protocol, cast

from imop import plugins
from imop.baselines.policy import REGRESSORS, make_regressor
from imop.errors import InvalidInput
from imop.evaluation.oracle import OraclePolicy, Poses
from imop.evaluation.replay import ReplayPolicy
from imop.evaluation.robots import PANDA, perception_for
from imop.evaluation.textbook import TextbookMatcher
from imop.networks.model import BUNDLED
from imop.policy.interfaces import Matcher
from imop.policy.one_shot import OneShotPolicy
from imop.policy.paper import paper_policy
from imop.policy.registration import RegistrationMatcher
from imop.types import Action, Demonstration, Observation

METHODS = (
    "replay",
    "textbook",
    "registration",
    "learned",
    "advancing",
    "paper",
    *REGRESSORS,
    "oracle",
    "expert",
)
_OWN = (
    "a class or function that makes, called without arguments, an object with watch, reset and act, named "
    "module:object or by an entry point imop.methods"
)


class Policy(Protocol):
    """What can be rolled out: shown demonstrations, then asked for actions."""

    def watch(self, demonstration: Demonstration) -> None:
        """Remember one demonstration."""

    def reset(self) -> None:
        """Begin a new episode."""

    def act(self, observation: Observation) -> Action:
        """The next action."""


def make_policy(
    method: str,
    world: Poses | None = None,
    min_confidence: float = 0.0,
    weights: Path | None = None,
    robot: str = PANDA,
) -> Policy:
    """A fresh policy by the name of its method.

    Args:
        method: learned, advancing (learned, but steps follow each other as shown), paper (the networks and
            one fit, without search and verification), replay, registration, textbook, oracle, act3d and rvt
            (regressors in the manner of these, which were trained on base tasks), rvt_ft and rvt_hdt (rvt,
            fine-tuned on the demonstration of a novel task), or one's own: "module:object", or an entry point
            of the group imop.methods. The object makes a `Policy` when it is called without arguments.
        world: the simulated world, which only the oracle reads.
        min_confidence: of the one-shot policies.
        weights: folder of the networks' weights; by default the bundled ones. Registration asks the
            verification network alone. Of the regressors, the folder of points/, views/ and views_hdt/.
        robot: name of the robot, see `perception_for`; one's own method deals with it itself.

    Raises:
        InvalidInput: for an unknown method or robot, what makes no policy, or an oracle without a world.
        MissingExtra: for textbook without Open3D.
        AssetMissing: for a regressor without weights.
    """
    if method == "replay":
        return ReplayPolicy()
    perception, reachable = perception_for(robot)
    if method in ("registration", "textbook"):
        registered = method == "registration"
        matcher: Matcher = (
            RegistrationMatcher.from_pretrained(weights or BUNDLED) if registered else TextbookMatcher()
        )
        return OneShotPolicy(matcher, perception, min_confidence=min_confidence, feasible=reachable)
    if method in ("learned", "advancing"):
        routed = None if method == "learned" else False
        return OneShotPolicy.from_pretrained(
            weights or BUNDLED, perception, min_confidence, routed, reachable
        )
    if method == "paper":
        return paper_policy(weights or BUNDLED, perception, min_confidence, reachable)
    if method in REGRESSORS:
        return make_regressor(method, perception, weights)
    if method == "oracle" and world is not None:
        return OraclePolicy(world)
    policy = find_method(method)()
    if not all(callable(getattr(policy, name, None)) for name in ("watch", "reset", "act")):
        raise InvalidInput("method", f"{method} makes a {type(policy).__name__}", _OWN)
    return cast(Policy, policy)


def find_method(name: str) -> Callable[[], object]:
    """What makes the policy of a method of one's own.

    Raises:
        InvalidInput: if there is none, or it is no class or function that can be called without arguments.
    """
    factory = plugins.find("method", name, "imop.methods")
    if factory is None:
        raise InvalidInput(
            "method", name, f"{', '.join(METHODS)} (oracle in simulation, expert in eval), or {_OWN}"
        )
    if not (inspect.isclass(factory) or inspect.isfunction(factory)):
        raise InvalidInput("method", f"{name} is a {type(factory).__name__}", _OWN)
    if not plugins.takes_nothing(factory):
        raise InvalidInput("method", f"{name} needs arguments", _OWN)
    made: Callable[[], object] = factory
    return made
