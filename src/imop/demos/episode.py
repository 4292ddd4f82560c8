"""A demonstration as plain attributes and stacked arrays, and back: what one episode of a store contains."""

import hashlib
import json
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from imop.errors import InvalidInput
from imop.types import Action, CameraView, Demonstration, Keyframe, Observation

Attributes = dict[str, Any]
Arrays = dict[str, NDArray[Any]]


class _Columns:
    """Stacks arrays of one name and shape, so that an episode is a few arrays and not hundreds."""

    def __init__(self) -> None:
        self.columns: dict[str, list[NDArray[Any]]] = {}

    def add(self, name: str, value: NDArray[Any] | None) -> list[Any] | None:
        """[column, row] where the value went, None for None."""
        if value is None:
            return None
        key = "_".join([name, "x".join(str(n) for n in value.shape)])
        column = self.columns.setdefault(key, [])
        column.append(value)
        return [key, len(column) - 1]


def pack(demonstration: Demonstration) -> tuple[Attributes, Arrays]:
    """Everything that `unpack` needs: attributes that JSON can hold, and arrays whose first axis counts rows.

    The attribute "arrays" lists shape, type and checksum of every array; "digest" is that of all others.

    Raises:
        InvalidInput: if an action carries a match: predictions are not stored.
    """
    columns = _Columns()
    attributes: Attributes = {
        "task": demonstration.task,
        "variation": int(demonstration.variation),
        "instructions": list(demonstration.instructions),
        "seeds": {name: int(seed) for name, seed in demonstration.seeds.items()},
        "observations": [
            _pack_observation(o, columns)
            for o in (*(k.observation for k in demonstration.keyframes), demonstration.final)
        ],
        "keyframes": [_pack_step(k, columns) for k in demonstration.keyframes],
    }
    arrays = {key: np.stack(rows) for key, rows in columns.columns.items()}
    attributes["arrays"] = {
        key: {"shape": list(a.shape), "dtype": a.dtype.name, "crc32": checksum(a)}
        for key, a in arrays.items()
    }
    attributes["digest"] = digest(attributes)
    return attributes, arrays


def digest(attributes: Mapping[str, Any]) -> str:
    """SHA-256 of all attributes but "digest", as JSON with sorted keys and no spaces.

    It says which episode it is: the attributes name the checksums of the arrays too.
    """
    others = {key: value for key, value in attributes.items() if key != "digest"}
    text = json.dumps(others, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def digest_of(demonstration: Demonstration) -> str:
    """The digest that `pack` gives it.

    Raises:
        InvalidInput: as `pack`.
    """
    return str(pack(demonstration)[0]["digest"])


def checksum(array: NDArray[Any]) -> int:
    """CRC-32 of the array's bytes."""
    return zlib.crc32(np.ascontiguousarray(array).data)


def _pack_observation(observation: Observation, columns: _Columns) -> Attributes:
    names = observation.instance_names
    return {
        # A list, because the order of the cameras counts and JSON objects do not promise one.
        "views": [
            {
                "camera": camera,
                "rgb": columns.add("rgb", view.rgb),
                "depth": columns.add("depth", view.depth),
                "intrinsics": columns.add("intrinsics", view.intrinsics),
                "T_world_camera": columns.add("T_world_camera", view.T_world_camera),
                "instance_ids": columns.add("instance_ids", view.instance_ids),
            }
            for camera, view in observation.views.items()
        ],
        "T_world_gripper": columns.add("T_world_gripper", observation.T_world_gripper),
        "gripper_opening": observation.gripper_opening,
        "time_step": observation.time_step,
        "joint_positions": columns.add("joint_positions", observation.joint_positions),
        "joint_velocities": columns.add("joint_velocities", observation.joint_velocities),
        "instance_names": None if names is None else [[int(i), name] for i, name in names.items()],
    }


def _pack_step(keyframe: Keyframe, columns: _Columns) -> Attributes:
    action = keyframe.action
    if action.match is not None:
        raise InvalidInput(
            "action.match", "a predicted action is no demonstration", "actions with match=None"
        )
    return {
        "T_world_gripper": columns.add("action_T_world_gripper", action.T_world_gripper),
        "gripper_open": action.gripper_open,
        "allow_collisions": action.allow_collisions,
        "confidence": float(action.confidence),
        "object_name": keyframe.object_name,
        "T_world_object": columns.add("T_world_object", keyframe.T_world_object),
    }


def unpack(attributes: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Demonstration:
    """The demonstration that was packed, equal in every field.

    Raises:
        Exception: some kind of it, if the parts do not fit together.
    """

    def at(place: list[Any] | None) -> Any:
        return None if place is None else arrays[place[0]][place[1]]

    observations = [_unpack_observation(o, at) for o in attributes["observations"]]
    steps = attributes["keyframes"]
    keyframes = tuple(
        Keyframe(
            observation,
            Action(
                at(step["T_world_gripper"]),
                step["gripper_open"],
                step["allow_collisions"],
                step["confidence"],
            ),
            step["object_name"],
            at(step["T_world_object"]),
        )
        for observation, step in zip(observations[:-1], steps, strict=True)
    )
    return Demonstration(
        keyframes,
        observations[-1],
        attributes["task"],
        attributes["variation"],
        tuple(attributes["instructions"]),
        dict(attributes["seeds"]),
    )


def _unpack_observation(o: Mapping[str, Any], at: Any) -> Observation:
    return Observation(
        views={
            view["camera"]: CameraView(
                at(view["rgb"]),
                at(view["depth"]),
                at(view["intrinsics"]),
                at(view["T_world_camera"]),
                at(view["instance_ids"]),
            )
            for view in o["views"]
        },
        T_world_gripper=at(o["T_world_gripper"]),
        gripper_opening=o["gripper_opening"],
        time_step=o["time_step"],
        joint_positions=at(o["joint_positions"]),
        joint_velocities=at(o["joint_velocities"]),
        instance_names=None if o["instance_names"] is None else dict(o["instance_names"]),
    )
