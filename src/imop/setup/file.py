"""The set-up as a file: TOML or JSON, by its ending. Errors name the field as it stands in the file."""

import json
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from imop.errors import CorruptData, InvalidInput
from imop.files import read, replaced
from imop.geometry import se3
from imop.robots.limits import Limits
from imop.setup.setup import (
    CameraSetup,
    GripperSetup,
    Part,
    RobotSetup,
    Setup,
    WorkspaceSetup,
)
from imop.types import FloatArray, as_finite, as_pose

T = TypeVar("T")
MISSING = object()
"""What is taken of a field that is not there."""
_POSE = "{position = [x, y, z], quaternion = [x, y, z, w]} in metres, or four rows of four numbers"
_INTRINSICS = "{fx = ..., fy = ..., cx = ..., cy = ...} in pixels, or three rows of three numbers"


def load_setup(path: Path) -> Setup:
    """Read a set-up.

    Args:
        path: a .toml or .json file.

    Raises:
        CorruptData: if it is missing, or neither TOML nor JSON.
        InvalidInput: for a field that is missing, unknown or cannot be; the field is named.
    """
    content = read(path, "write one, see docs/real_robot/setup.md").decode(errors="replace")
    try:
        fields = file_format(path).loads(content)
    except ValueError as error:
        raise CorruptData(path, f"cannot be read ({error})", "mend what is said there") from error
    return from_dict(fields, path.parent)


def save_setup(setup: Setup, path: Path) -> None:
    """Write a set-up; `load_setup` gives it back. A model's path is written as it is.

    Raises:
        InvalidInput: if the ending is neither .toml nor .json.
    """
    form, fields = file_format(path), to_dict(setup)
    with replaced(path) as temporary:
        temporary.write_text(_toml(fields) if form is tomllib else json.dumps(fields, indent=2) + "\n")


def from_dict(fields: Mapping[str, Any], folder: Path = Path()) -> Setup:
    """The set-up of what stands in a file; a model's path is relative to `folder`.

    Raises:
        InvalidInput: for a field that is missing, unknown or cannot be.
    """
    top = Table("", fields)
    robot, workspace = top.table("robot"), top.table("workspace")
    gripper, limits = top.table("gripper", optional=True), top.table("limits", optional=True)
    cameras, parts = top.table("cameras"), top.table("parts", optional=True)
    top.end()
    setup = Setup(
        _robot(robot, folder),
        _made(workspace, WorkspaceSetup, lower=np.array, upper=np.array, table_height=float),
        {name: _camera(cameras.table(name)) for name in cameras.names()},
        _gripper(gripper) if gripper.names() else None,
        _made(limits, Limits, speed=float, turn=float, joint_speed=float),
        {
            name: _made(parts.table(name), Part, size=np.array, T_gripper_part=read_pose)
            for name in parts.names()
        },
    )
    return setup


def to_dict(setup: Setup) -> dict[str, Any]:
    """What stands in a file, of plain values."""
    robot, gripper = setup.robot, setup.gripper
    fields: dict[str, Any] = {
        "robot": {
            "model": robot.model,
            "home": robot.home.tolist(),
            "T_world_base": pose_fields(robot.T_world_base),
        }
    }
    if robot.joints:
        fields["robot"]["joints"] = list(robot.joints)
    fields["robot"] |= _given(robot, "driver", "address")
    if gripper is not None:
        fields["gripper"] = {
            "stroke": gripper.stroke,
            "tip": gripper.tip.tolist(),
            "approach": gripper.approach.tolist(),
            "closing": gripper.closing.tolist(),
            "flange": gripper.flange,
            "fingers": {name: list(both) for name, both in gripper.fingers.items()},
        }
    workspace, limits = setup.workspace, setup.limits
    fields["workspace"] = {
        "lower": workspace.lower.tolist(),
        "upper": workspace.upper.tolist(),
        "table_height": workspace.table_height,
    }
    fields["limits"] = {"speed": limits.speed, "turn": limits.turn, "joint_speed": limits.joint_speed}
    fields["cameras"] = {name: _plain_camera(camera) for name, camera in setup.cameras.items()}
    if setup.parts:
        fields["parts"] = {
            name: {"size": part.size.tolist(), "T_gripper_part": pose_fields(part.T_gripper_part)}
            for name, part in setup.parts.items()
        }
    return fields


class Table:
    """A table of the file, whose fields are taken one by one."""

    def __init__(self, name: str, fields: Any):
        if not isinstance(fields, Mapping):
            raise InvalidInput(name or "file", f"{type(fields).__name__}", "a table of named values")
        self.name, self._fields, self._known = name, dict(fields), list[str]()

    def field(self, name: str) -> str:
        """How errors call a field."""
        return f"{self.name}.{name}" if self.name else name

    def names(self) -> list[str]:
        """Of all fields."""
        return list(self._fields)

    def take(self, name: str, read_value: Callable[[Any], T], accepted: str = "") -> Any:
        """The value of a field, or `MISSING`."""
        self._known.append(name)
        value = self._fields.pop(name, MISSING)
        if value is MISSING:
            return MISSING
        try:
            return read_value(value)
        except InvalidInput as error:
            inside = "" if error.field in (name, "pose", "intrinsics") else f".{error.field}"
            raise InvalidInput(self.field(name) + inside, error.problem, error.accepted) from error
        except (TypeError, ValueError) as error:
            raise InvalidInput(self.field(name), f"{value!r}", accepted or "a number or numbers") from error

    def table(self, name: str, optional: bool = False) -> "Table":
        """The table in a field, empty if it is missing and that is allowed."""
        self._known.append(name)
        value = self._fields.pop(name, {} if optional else MISSING)
        if value is MISSING:
            raise InvalidInput(self.field(name), "missing", f"a table [{self.field(name)}]")
        return Table(self.field(name), value)

    def end(self) -> None:
        """Refuse what nobody took."""
        for name in self._fields:
            raise InvalidInput(self.field(name), "unknown", ", ".join(self._known))


def _made(table: Table, kind: Callable[..., T], **readers: Callable[[Any], Any]) -> T:
    """An object of the fields of a table, without those that are missing."""
    values = {
        name: table.take(name, read_value, _accepted(read_value)) for name, read_value in readers.items()
    }
    table.end()
    given = {name: value for name, value in values.items() if value is not MISSING}
    try:
        return kind(**given)
    except InvalidInput as error:
        inside = error.field.startswith(f"{table.name}.")
        field = error.field if inside else table.field(error.field)
        raise InvalidInput(field, error.problem, error.accepted) from error
    except TypeError as error:
        lacking = [name for name in readers if f"'{name}'" in str(error)]
        if not lacking:
            raise
        accepted = _accepted(readers[lacking[0]]) or "a value"
        raise InvalidInput(table.field(lacking[0]), "missing", accepted) from error


def _robot(table: Table, folder: Path) -> RobotSetup:
    def model(value: Any) -> str:
        return str((folder / value).resolve()) if str(value).endswith((".xml", ".urdf")) else read_text(value)

    return _made(
        table,
        RobotSetup,
        model=model,
        home=np.array,
        T_world_base=read_pose,
        joints=read_names,
        driver=read_text,
        address=read_text,
    )


def _gripper(table: Table) -> GripperSetup:
    return _made(
        table,
        GripperSetup,
        stroke=float,
        tip=np.array,
        approach=np.array,
        closing=np.array,
        flange=read_text,
        fingers=dict,
    )


def _camera(table: Table) -> CameraSetup:
    return _made(
        table,
        CameraSetup,
        intrinsics=read_intrinsics,
        size=tuple,
        T_world_camera=read_pose,
        T_gripper_camera=read_pose,
        seen_as=read_text,
        driver=read_text,
        serial=read_text,
    )


def _accepted(read_value: Callable[[Any], Any]) -> str:
    known: dict[Any, str] = {
        read_pose: _POSE,
        read_intrinsics: _INTRINSICS,
        read_text: "a text",
        read_names: "a list of names",
        float: "a number",
        tuple: "[width, height] in pixels",
        np.array: "a list of numbers",
        dict: "a table of joints, each with [closed, open]",
    }
    return known.get(read_value, "")


def read_text(value: Any) -> str:
    """The value, if it is a text.

    Raises:
        TypeError: if it is none.
    """
    if not isinstance(value, str):
        raise TypeError
    return value


def read_names(value: Any) -> tuple[str, ...]:
    """The texts of a list.

    Raises:
        TypeError: if it is none.
    """
    if not isinstance(value, list):
        raise TypeError
    return tuple(read_text(one) for one in value)


def read_pose(value: Any) -> FloatArray:
    """A pose (4, 4) as files have it: position and quaternion x y z w, or four rows of four numbers.

    Raises:
        InvalidInput: if it is neither.
    """
    if not isinstance(value, Mapping):
        return as_pose("pose", value)
    table = Table("", value)
    position = table.take("position", lambda p: as_finite("position", p, (3,)))
    quaternion = table.take("quaternion", lambda q: as_finite("quaternion", q, (4,)))
    table.end()
    if position is MISSING or quaternion is MISSING:
        raise InvalidInput("pose", f"only {', '.join(value) or 'nothing'}", _POSE)
    return se3.from_pose7(np.concatenate([position, quaternion]))


def read_intrinsics(value: Any) -> FloatArray:
    """(3, 3) as files have it: fx, fy, cx and cy in pixels, or three rows of three numbers.

    Raises:
        InvalidInput: if it is neither.
    """
    if not isinstance(value, Mapping):
        return as_finite("intrinsics", value, (3, 3))
    table = Table("", value)
    found = [table.take(name, float, "pixels") for name in ("fx", "fy", "cx", "cy")]
    table.end()
    if MISSING in found:
        raise InvalidInput("intrinsics", f"only {', '.join(value) or 'nothing'}", _INTRINSICS)
    fx, fy, cx, cy = found
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])


def pose_fields(T_a_b: FloatArray) -> dict[str, list[float]]:
    """A pose (4, 4) as files have it: position, metres, and quaternion, x y z w."""
    pose = se3.to_pose7(T_a_b)
    return {"position": pose[:3].tolist(), "quaternion": pose[3:].tolist()}


def intrinsics_fields(K: FloatArray) -> dict[str, float]:
    """(3, 3) as files have it: fx, fy, cx, cy, pixels."""
    return {"fx": float(K[0, 0]), "fy": float(K[1, 1]), "cx": float(K[0, 2]), "cy": float(K[1, 2])}


def _plain_camera(camera: CameraSetup) -> dict[str, Any]:
    fields: dict[str, Any] = {
        "size": list(camera.size),
        "intrinsics": intrinsics_fields(camera.intrinsics),
    }
    for name in ("T_world_camera", "T_gripper_camera"):
        if getattr(camera, name) is not None:
            fields[name] = pose_fields(getattr(camera, name))
    return fields | _given(camera, "seen_as", "driver", "serial")


def _given(made: Any, *names: str) -> dict[str, str]:
    """Texts that are not empty."""
    return {name: getattr(made, name) for name in names if getattr(made, name)}


def file_format(path: Path, field: str = "setup") -> Any:
    """The module, tomllib or json, that reads a file, by its ending.

    Raises:
        InvalidInput: if it has another one; the error names `field`.
    """
    found = {".toml": tomllib, ".json": json}.get(path.suffix)
    if found is None:
        raise InvalidInput(field, f"{path}", "a file that ends in .toml or .json")
    return found


def _toml(fields: Mapping[str, Any]) -> str:
    """Tables of values, and tables of such tables (cameras, parts), as TOML."""
    lines: list[str] = []
    for name, table in fields.items():
        nested = name in ("cameras", "parts")
        for title, values in [(f"{name}.{n}", t) for n, t in table.items()] if nested else [(name, table)]:
            head, *rest = title.split(".", 1)
            lines.append("[" + ".".join([head, *(json.dumps(n, ensure_ascii=False) for n in rest)]) + "]")
            lines += [f"{key} = {_value(value)}" for key, value in values.items()] + [""]
    return "\n".join(lines)


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(k)} = {_value(v)}" for k, v in value.items()) + "}"
    # Texts, numbers and lists of them are written alike in JSON and TOML.
    return json.dumps(value, ensure_ascii=False)
