"""Observations, demonstrations and actions as plain dicts of arrays and scalars, and back.

The table of the names stands in docs/real_robot/serving.md. What arrives is validated as everything else, and
errors name the entry, such as views.front.depth.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from imop.errors import InvalidInput
from imop.serving.limits import Limits
from imop.types import Action, CameraView, Demonstration, Keyframe, Match, Observation, as_array

if TYPE_CHECKING:
    from imop.geometry.focus import Focus

PROTOCOL = 1
"""Version of these names; a server says it in its metadata."""

LETTERS = 100
"""Names of fields and cameras are no longer."""

Fields = dict[str, Any]
T = TypeVar("T")

_VIEW = ("rgb", "depth", "intrinsics", "T_world_camera")
_OBSERVATION = ("views", "T_world_gripper", "gripper_opening")
_OBSERVATION_MAY = ("time_step", "joint_positions")
_REQUEST_MAY = ("reset", "demonstrations", "focus")
_FOCUS_MAY = ("masks", "points", "box")
_ACTION = ("T_world_gripper", "gripper_open")
_ACTION_MAY = ("allow_collisions",)
_REPLY_MAY = ("confidence", "reachable", "match", "actions", "server_timing")
_MATCH = ("step", "p_support", "p_query", "region", "T_query_support", "generator", "probability")


@dataclass(frozen=True, eq=False)
class Request:
    """What a client asks for.

    Attributes:
        reset: whether a new episode begins.
        demonstrations: what the session shall know instead of what it knew; empty leaves it as it is.
        observation: what is seen, or None if no action is asked for.
        focus: which thing of the observation is meant, if somebody said so.
    """

    reset: bool
    demonstrations: tuple[Demonstration, ...]
    observation: Observation | None
    focus: "Focus | None" = None


def to_request(message: Any, limits: Limits, time_step: int = 0) -> Request:
    """The request of an unpacked message.

    Args:
        message: its fields.
        limits: on points and keyframes.
        time_step: of an observation that does not say it.

    Raises:
        InvalidInput: if something is missing, unknown, malformed or too large.
    """
    fields = _fields("message", message, (), (*_REQUEST_MAY, *_OBSERVATION, *_OBSERVATION_MAY))
    reset = _flag("reset", fields.pop("reset", False))
    focus = fields.pop("focus", None)
    shown = _list("demonstrations", fields.pop("demonstrations", []))
    steps = sum(len(s) for d in shown if isinstance(d, dict) and isinstance(s := d.get("keyframes"), list))
    if steps > limits.keyframes:
        raise InvalidInput("demonstrations", f"{steps} keyframes", f"at most {limits.keyframes}")
    demonstrations = _each("demonstrations", lambda one: to_demonstration(one, limits), shown)
    if not fields and (focus is not None or not (reset or demonstrations)):
        raise InvalidInput("message", "asks for nothing", "an observation, demonstrations, or reset = True")
    observation = to_observation({"time_step": time_step, **fields}, limits) if fields else None
    meant = None if focus is None else _within("focus", _to_focus, focus)
    return Request(reset, tuple(demonstrations), observation, meant)


def observation_fields(observation: Observation) -> Fields:
    """What a policy may know of an observation."""
    views = {
        name: {
            "rgb": view.rgb,
            "depth": view.depth,
            "intrinsics": view.intrinsics,
            "T_world_camera": view.T_world_camera,
        }
        for name, view in observation.views.items()
    }
    fields: Fields = {
        "views": views,
        "T_world_gripper": observation.T_world_gripper,
        "gripper_opening": observation.gripper_opening,
        "time_step": observation.time_step,
    }
    if observation.joint_positions is not None:
        fields["joint_positions"] = observation.joint_positions
    return fields


def focus_fields(focus: "Focus") -> Fields:
    """What is meant, in the ways in which it was said."""
    said = {name: getattr(focus, name) for name in _FOCUS_MAY}
    return {name: value for name, value in said.items() if value is not None}


def to_observation(value: Any, limits: Limits) -> Observation:
    """The observation of its fields; raises as `to_request` does."""
    fields = _fields("observation", value, _OBSERVATION, _OBSERVATION_MAY)
    views = _names("views", fields["views"])
    _check_points(views, limits)
    time_step = _scalar("time_step", fields.get("time_step", 0))
    if not 0 <= time_step < 2**31 or time_step != int(time_step):
        raise InvalidInput("time_step", f"{time_step}", "an integer from 0 on")
    return Observation(
        {name: _within(f"views.{name}", _to_view, view) for name, view in views.items()},
        fields["T_world_gripper"],
        _scalar("gripper_opening", fields["gripper_opening"]),
        int(time_step),
        fields.get("joint_positions"),
    )


def demonstration_fields(demonstration: Demonstration) -> Fields:
    """What a policy may know of a demonstration."""
    keyframes = [
        {
            "observation": observation_fields(keyframe.observation),
            "action": {
                "T_world_gripper": keyframe.action.T_world_gripper,
                "gripper_open": keyframe.action.gripper_open,
                "allow_collisions": keyframe.action.allow_collisions,
            },
        }
        for keyframe in demonstration.keyframes
    ]
    return {
        "keyframes": keyframes,
        "final": observation_fields(demonstration.final),
        "instructions": list(demonstration.instructions),
    }


def to_demonstration(value: Any, limits: Limits) -> Demonstration:
    """The demonstration of its fields; raises as `to_request` does."""
    fields = _fields("demonstration", value, ("keyframes", "final"), ("instructions",))
    instructions = _list("instructions", fields.get("instructions", []))
    if not all(isinstance(words, str) for words in instructions):
        raise InvalidInput("instructions", "not all are texts", "a list of strings")
    steps = _list("keyframes", fields["keyframes"])
    return Demonstration(
        tuple(_each("keyframes", lambda step: _to_keyframe(step, limits), steps)),
        _within("final", lambda seen: to_observation(seen, limits), fields["final"]),
        instructions=tuple(instructions),
    )


def action_fields(action: Action) -> Fields:
    """An action with the evidence for it."""
    match = action.match
    return {
        "T_world_gripper": action.T_world_gripper,
        "gripper_open": action.gripper_open,
        "allow_collisions": action.allow_collisions,
        "confidence": float(action.confidence),
        "reachable": None if action.reachable is None else bool(action.reachable),
        "match": None if match is None else {name: getattr(match, name) for name in _MATCH},
    }


def to_action(value: Any) -> Action:
    """The action of a reply; raises as `to_request` does."""
    fields = _fields("reply", value, _ACTION, (*_ACTION_MAY, *_REPLY_MAY))
    match, reachable = fields.get("match"), fields.get("reachable")
    return replace(
        _to_shown_action({name: fields[name] for name in (*_ACTION, *_ACTION_MAY) if name in fields}),
        confidence=_scalar("confidence", fields.get("confidence", 1.0)),
        match=None if match is None else _within("match", _to_match, match),
        reachable=None if reachable is None else _flag("reachable", reachable),
    )


def _to_shown_action(value: Any) -> Action:
    fields = _fields("action", value, _ACTION, _ACTION_MAY)
    return Action(
        fields["T_world_gripper"],
        _flag("gripper_open", fields["gripper_open"]),
        _flag("allow_collisions", fields.get("allow_collisions", False)),
    )


def _to_focus(value: Any) -> "Focus":
    # Clients do without what it imports.
    from imop.geometry.focus import Focus

    fields = _fields("focus", value, (), _FOCUS_MAY)
    if "masks" in fields:
        masks = _names("masks", fields["masks"])
        fields["masks"] = {name: as_array(name, mask, (None, None), np.bool_) for name, mask in masks.items()}
    return Focus(**fields)


def _to_keyframe(value: Any, limits: Limits) -> Keyframe:
    fields = _fields("keyframe", value, ("observation", "action"))
    return Keyframe(
        _within("observation", lambda seen: to_observation(seen, limits), fields["observation"]),
        _within("action", _to_shown_action, fields["action"]),
    )


def _to_match(value: Any) -> Match:
    return Match(**_fields("match", value, _MATCH))


def _to_view(value: Any) -> CameraView:
    fields = _fields("view", value, _VIEW)
    depth = fields["depth"]
    if not (isinstance(depth, np.ndarray) and depth.dtype.kind == "f"):
        # Integers are millimetres as a rule.
        found = f"of {depth.dtype}" if isinstance(depth, np.ndarray) else f"a {type(depth).__name__}"
        raise InvalidInput("depth", found, "an array of float32, metres")
    return CameraView(**fields)


def _check_points(views: Mapping[str, Any], limits: Limits) -> None:
    images = [view.get("depth") for view in views.values() if isinstance(view, dict)]
    points = sum(depth.size for depth in images if isinstance(depth, np.ndarray))
    if points > limits.points:
        raise InvalidInput("views", f"{points} pixels", f"at most {limits.points} in all views together")


def _names(name: str, value: Any) -> Fields:
    if not (isinstance(value, dict) and all(isinstance(key, str) and len(key) <= LETTERS for key in value)):
        raise InvalidInput(
            name, f"a {type(value).__name__}", f"a map with names of at most {LETTERS} letters"
        )
    return dict(value)


def _fields(name: str, value: Any, needed: tuple[str, ...], others: tuple[str, ...] = ()) -> Fields:
    """A copy of a map that has all fields that are needed, and no unknown ones."""
    fields = _names(name, value)
    known = ", ".join((*needed, *others))
    for field in needed:
        if field not in fields:
            raise InvalidInput(field, "is missing", f"the {name} has {known}")
    for field in fields:
        if field not in needed and field not in others:
            raise InvalidInput(field, f"is no field of the {name}", known)
    return fields


def _list(name: str, value: Any) -> list[Any]:
    if not isinstance(value, list):
        raise InvalidInput(name, f"a {type(value).__name__}", "a list")
    return value


def _scalar(name: str, value: Any) -> float:
    """A number, which may come as an array of one element."""
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.item()
    if not isinstance(value, bool | int | float | np.bool_ | np.integer | np.floating):
        raise InvalidInput(name, f"a {type(value).__name__}", "a number")
    return float(value)


def _flag(name: str, value: Any) -> bool:
    number = _scalar(name, value)
    if number not in (0, 1):
        raise InvalidInput(name, f"{number}", "true or false")
    return bool(number)


def _each(name: str, made: Callable[[Any], T], values: list[Any]) -> list[T]:
    return [_within(f"{name}.{number}", made, value) for number, value in enumerate(values)]


def _within(name: str, made: Callable[[Any], T], value: Any) -> T:
    """What is made of a value; errors say of what their field is."""
    try:
        return made(value)
    except InvalidInput as error:
        raise InvalidInput(f"{name}.{error.field}", error.problem, error.accepted) from error
