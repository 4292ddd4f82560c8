"""What all objects of a model share, and the kinds that are not shapes."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from imop.errors import ModelFormatError
from imop.tasks.coppelia.model import Dummy, ForceSensor, Joint, PathObject, ProximitySensor, SceneObject
from imop.tasks.coppelia.paths import ControlPoint, polyline
from imop.tasks.coppelia.sections import Section, Values

MOST_CURVE_POINTS = 1000
_SHOWN_LAYERS = 0x00FF
_COLLIDABLE, _RENDERABLE = 0x1, 0x200
_NOT_COLLIDABLE, _NO_DYNAMICS, _NO_CONTACTS, _NOT_SHOWN = 0x1, 0x20, 0x40, 0x100


@dataclass(frozen=True)
class Common:
    """The common part of an object.

    Attributes:
        handle: its number in the file.
        parent: the parent's, -1 for none.
        fields: what `SceneObject` holds, but the parent.
        switched_off: what it switches off in the model that it is the base of, as bits; 0 if it is none.
        offset: where it stands in the body.
    """

    handle: int
    parent: int
    fields: dict[str, Any]
    switched_off: int
    offset: int

    def inherit(self, flags: int) -> "dict[str, Any]":
        """The fields, less what the models around it switch off."""
        shown = self.fields["shown"] and not flags & _NOT_SHOWN
        return {
            **self.fields,
            "shown": shown,
            "collidable": self.fields["collidable"] and not flags & _NOT_COLLIDABLE,
        }


def dynamic_allowed(flags: int) -> bool:
    """Whether a model with these switches lets forces move its parts."""
    return not flags & _NO_DYNAMICS


def contacts_allowed(flags: int) -> bool:
    """Whether a model with these switches lets others bump into its parts."""
    return not flags & _NO_CONTACTS


def read_common(section: Section) -> Common:
    """The part of an object before NXT."""
    ids = section.require("Ids")
    handle, parent = (int(i) for i in ids.ints(2))
    properties, layers, model = section.get("Op2"), section.get("Lar"), section.get("Mpo")
    special = section.get("Omp")
    abilities = 0 if special is None else special.one_int()
    bits = 4 if properties is None else properties.one_int()
    layer = 1 if layers is None else layers.u16()
    if not bits & 4:  # of the time when layers had other numbers, all hidden
        layer <<= 8
    base = section.get("Va3") or section.get("Va2") or section.get("Var")
    is_base = base is not None and bool(base.u8() & 1)
    fields = {
        "name": section.require("Nme").text(),
        "T_parent_object": section.require("Cfq").pose(position_first=False),
        "extension": section.text("Rst"),
        "shown": bool(layer & _SHOWN_LAYERS),
        "collidable": bool(abilities & _COLLIDABLE),
        "renderable": bool(abilities & _RENDERABLE),
        "model_base": is_base,
        "hidden_in_box": bool(bits & 0x100),
    }
    switched_off = model.one_int() if is_base and model is not None else 0
    return Common(handle, parent, fields, switched_off, section.start)


def read_joint(section: Section, dynamic: bool, fields: dict[str, Any]) -> Joint:
    """The own part of a joint."""
    kinds: dict[int, Literal["revolute", "prismatic", "spherical"]]
    kinds = {10: "revolute", 11: "prismatic", 12: "spherical"}
    values = section.require("Jtt")
    kind = values.one_int()
    if kind not in kinds:
        raise ModelFormatError(values.at - 4, f"a joint of kind {kind}", f"one of {list(kinds)}")
    flags, mode = section.flags("Va9"), section.get("Jmd")
    w, x, y, z = _floats(section, "Jst", (1.0, 0.0, 0.0, 0.0))
    low, extent = _floats(section, "Pmr", (0.0, 0.0))
    pitch = _floats(section, "Jsp", (0.0,))[0]
    velocity, force = _floats(section, "Dmp", (0.0, 0.0))
    stiffness, damping = _floats(section, "Spp", (0.0, 0.0))
    length, diameter = _floats(section, "Arg", (0.02, 0.01))
    return Joint(
        kind=kinds[kind],
        position=_floats(section, "Prt", (0.0,))[0],
        orientation=np.array([x, y, z, w])
        if w * w + x * x + y * y + z * z > 1e-6
        else np.array([0, 0, 0, 1.0]),
        limits=None if flags & 1 and kind == 10 else (low, low + max(extent, 0.0)),
        lead=pitch if kind == 10 else 0.0,
        dynamic=dynamic and mode is not None and mode.one_int() == 5,
        motor=_motor(flags),
        target_velocity=velocity,
        target_position=_floats(section, "Dtp", (0.0,))[0],
        max_force=abs(force),
        stiffness=abs(stiffness),
        damping=abs(damping),
        size=(abs(length), abs(diameter)),
        **fields,
    )


def _motor(flags: int) -> Literal["off", "velocity", "position", "spring"]:
    if not flags & 0x10:
        return "off"
    if not flags & 0x20:
        return "velocity"
    return "spring" if flags & 0x80 else "position"


def _floats(section: Section, tag: str, otherwise: tuple[float, ...]) -> tuple[float, ...]:
    values = section.get(tag)
    if values is None:
        return otherwise
    return tuple(float(x) for x in values.floats(len(otherwise)))


def read_sensor(section: Section, fields: dict[str, Any]) -> ProximitySensor:
    """The own part of a proximity sensor."""
    volume = section.inner("Vod")
    if volume is None:
        raise ModelFormatError(section.start, "a sensor without a volume", "an item Vod")
    kinds: tuple[Literal["pyramid", "cylinder", "disc", "cone", "ray"], ...]
    kinds = ("pyramid", "cylinder", "disc", "cone", "ray")
    kind = kinds[volume.require("Snt").count(len(kinds) - 1)]
    sizes = volume.require("Ss3")
    start = sizes.at
    offset, range_, x, y, x_far, y_far, radius, radius_far, _ = sizes.any_floats(9)
    near, far = ((x / 2, y / 2), (x_far / 2, y_far / 2))
    if kind != "pyramid":
        near, far = (radius, radius), (radius_far, radius_far)
    if kind == "ray":
        near = far = (0.0, 0.0)
    used = np.abs([offset, range_, *near, *far])
    if not np.all(used < 1e3):
        raise ModelFormatError(start, "a sensor of huge or no size", "metres below 1000")
    flags = section.flags("Pr4")
    return ProximitySensor(
        kind=kind,
        offset=float(offset),
        range=float(range_),
        near=(float(abs(near[0])), float(abs(near[1]))),
        far=(float(abs(far[0])), float(abs(far[1]))),
        front_faces=not flags & 0x10,
        back_faces=not flags & 0x20,
        **fields,
    )


def read_path(section: Section, fields: dict[str, Any]) -> PathObject:
    """The own part of a path."""
    curve = section.inner("Ntp")
    if curve is None:
        raise ModelFormatError(section.start, "a path without points", "an item Ntp")
    attributes = curve.get("At2")
    closed = attributes is not None and bool(attributes.one_int() & 4)
    points = [_control_point(point.require("At2")) for point in curve.all_inner("Pat")]
    return PathObject(T_path_points=polyline(points, closed), closed=closed, **fields)


def _control_point(values: Values) -> ControlPoint:
    T = values.pose(position_first=True)
    before, after = (float(np.clip(f, 0, 1)) for f in values.floats(2))
    return ControlPoint(T, before, after, values.count(MOST_CURVE_POINTS))


def read_dummy(section: Section, fields: dict[str, Any]) -> tuple[Dummy, int]:
    """The own part of a dummy, and the handle of the dummy it is linked with (-1 for none)."""
    link = section.get("Lli")
    size = abs(_floats(section, "Dy2", (0.01,))[0])
    return Dummy(size=size, **fields), -1 if link is None else link.one_int()


def read_other(section: Section, fields: dict[str, Any]) -> SceneObject:
    """An object that is only a frame to us."""
    del section
    return SceneObject(**fields)


def read_force_sensor(section: Section, fields: dict[str, Any]) -> ForceSensor:
    """A rigid link."""
    del section
    return ForceSensor(**fields)
