"""One client's conversation: its requests are answered by a policy of its own."""

import inspect
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np

from imop.errors import InvalidInput, NoConfidentMatch
from imop.geometry import se3
from imop.geometry.focus import Focus
from imop.serving import schema, wire
from imop.serving.limits import Limits
from imop.types import Action, Demonstration, FloatArray, Observation


class Policy(Protocol):
    """What can be served: shown demonstrations, then asked for actions."""

    def watch(self, demonstration: Demonstration) -> None:
        """Remember one demonstration."""

    def reset(self) -> None:
        """Begin a new episode."""

    def act(self, observation: Observation) -> Action:
        """The next action."""


MakePolicy = Callable[[], Policy]


class Outcome(Enum):
    """How a request went: answered, refused while the episode goes on, or failed, which ends the session."""

    ANSWERED, REFUSED, FAILED = range(3)


@dataclass(frozen=True)
class Reply:
    """The answer to one request: a message, or the text of an error."""

    outcome: Outcome
    content: bytes


class Session:
    """The state of one connection: its policy and how far its episode is.

    Args:
        make: a policy that has watched nothing.
        policy: one that has watched what was preloaded.
        preloaded: how many demonstrations that were.
        limits: on points and keyframes.
    """

    def __init__(self, make: MakePolicy, policy: Policy, preloaded: int, limits: Limits):
        self._make, self._policy, self._watched, self._limits = make, policy, preloaded, limits
        self._actions = 0
        policy.reset()

    def reply(self, message: bytes | bytearray, timing: dict[str, float]) -> Reply:
        """The reply to a message; whatever goes wrong is told as openpi tells it, by the traceback.

        Args:
            message: as it arrived.
            timing: what the server knows of it, passed on in `server_timing`.
        """
        try:
            return Reply(Outcome.ANSWERED, self._answer(message, timing))
        except NoConfidentMatch:
            return Reply(Outcome.REFUSED, traceback.format_exc().encode())
        except Exception:
            return Reply(Outcome.FAILED, traceback.format_exc().encode())

    def _answer(self, message: bytes | bytearray, timing: dict[str, float]) -> bytes:
        started = time.perf_counter()
        request = schema.to_request(wire.unpack(message), self._limits, self._actions)
        if request.demonstrations:
            self._watch(request.demonstrations)
        elif request.reset:
            self._begin()
        fields: schema.Fields = {}
        if request.observation is not None:
            action = self._act(request.observation, request.focus)
            fields = {**schema.action_fields(action), "actions": row(action)[None]}
        infer_ms = (time.perf_counter() - started) * 1e3
        return wire.pack({**fields, "server_timing": {**timing, "infer_ms": infer_ms}})

    def _watch(self, demonstrations: Sequence[Demonstration]) -> None:
        if self._watched:
            # No policy forgets a demonstration, and to make one takes a second.
            self._policy = self._make()
        for demonstration in demonstrations:
            self._policy.watch(demonstration)
        self._watched = len(demonstrations)
        self._begin()

    def _begin(self) -> None:
        self._policy.reset()
        self._actions = 0

    def _act(self, observation: Observation, focus: Focus | None) -> Action:
        if not self._watched:
            accepted = "demonstrations in this message or before, or a server that was started with --demo"
            raise InvalidInput("demonstrations", "none was preloaded or sent", accepted)
        if focus is None:
            action = self._policy.act(observation)
        elif "focus" in inspect.signature(self._policy.act).parameters:
            action = self._policy.act(observation, focus=focus)  # type: ignore[call-arg]
        else:
            raise InvalidInput("focus", "this server's policy takes none", "an observation without it")
        self._actions += 1
        return action


def row(action: Action) -> FloatArray:
    """(9,): position in metres, quaternion xyzw, gripper open 0 or 1, collisions allowed 0 or 1."""
    flags = [action.gripper_open, action.allow_collisions]
    return np.concatenate([se3.to_pose7(action.T_world_gripper), flags])
