"""From the bytes of a .ttm file to the tree of what it says.

Files come from anywhere, so nothing in them is believed: every length, index and number is checked before
use, and work and memory are bounded by the file's size.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from imop.errors import ModelFormatError
from imop.tasks.coppelia import objects
from imop.tasks.coppelia.arrays import SharedArrays
from imop.tasks.coppelia.container import unpack
from imop.tasks.coppelia.model import Dummy, Model, SceneObject
from imop.tasks.coppelia.sections import Section, read_section
from imop.tasks.coppelia.shapes import Resources, read_shape
from imop.tasks.coppelia.texture import read_texture

_FRAMES = ("RSN", "CMA", "LGT", "GRH", "MIR", "MIL", "OCT", "PTC", "SCT", "MKR", "CSO")
"""Objects of which only the frame matters here."""
_OBJECTS = ("SHP", "JNT", "DMY", "SNR", "FSE", "PAT", *_FRAMES)
MOST_OBJECTS = 5000
_DEEPEST = 200

_Read = tuple[str, objects.Common, Section]


def read_file(path: Path) -> Model:
    """The model in a .ttm file.

    Raises:
        ModelFormatError: if it is not a readable model.
        OSError: if there is no such file.
    """
    return read_model(path.read_bytes())


def read_model(data: bytes) -> Model:
    """The model that a .ttm file's bytes say.

    Raises:
        ModelFormatError: with a byte offset (of the file in its header and codes, else of the unpacked body).
    """
    return read_body(unpack(data))


def read_body(body: bytes) -> Model:
    """The model that an unpacked body says.

    Raises:
        ModelFormatError: with a byte offset.
    """
    top, end = read_section(body, 0, len(body), "EOF")
    if end != len(body):
        raise ModelFormatError(end, f"{len(body) - end} bytes are left", "the end of the file")
    textures = dict(read_texture(section) for section in top.all_inner("TEX"))
    shared = Resources(SharedArrays(top.inner("VIN")), textures)
    return Model(_link(_read_objects(top), shared), textures)


def _read_objects(top: Section) -> list[_Read]:
    found: list[_Read] = []
    for tag, start, end in top.items:
        if tag in _OBJECTS:
            common, own_start = read_section(top.body, start, end, "NXT")
            own, _ = read_section(top.body, own_start, end)
            found.append((tag, objects.read_common(common), own))
    if len(found) > MOST_OBJECTS:
        raise ModelFormatError(0, f"{len(found)} objects", f"at most {MOST_OBJECTS}")
    return found


def _link(found: list[_Read], shared: Resources) -> tuple[SceneObject, ...]:
    """The objects, parents first, with indices instead of handles."""
    by_handle: dict[int, _Read] = {}
    names: set[str] = set()
    for read in found:
        common = read[1]
        name = common.fields["name"]
        if common.handle in by_handle or name in names or not name:
            raise ModelFormatError(common.offset, f"a second object {name!r}", "unique names and handles")
        by_handle[common.handle] = read
        names.add(name)
    order = _parents_first(found, by_handle)
    place = {common.handle: i for i, (_, common, _) in enumerate(order)}
    linked: list[SceneObject] = []
    partners: list[int] = []
    off: list[int] = []
    for tag, common, own in order:
        parent = place.get(common.parent, -1)
        flags = common.switched_off | (off[parent] if parent >= 0 else 0)
        off.append(flags)
        made, partner = _make(tag, own, flags, shared, {"parent": parent, **common.inherit(flags)})
        linked.append(made)
        partners.append(place.get(partner, -1))
    return tuple(
        replace(o, linked=p) if isinstance(o, Dummy) else o for o, p in zip(linked, partners, strict=True)
    )


def _parents_first(found: list[_Read], by_handle: dict[int, _Read]) -> list[_Read]:
    depth: dict[int, int] = {}
    for _, common, _ in found:
        way: list[int] = []
        at = common.handle
        while at in by_handle and at not in depth:
            if at in way or len(way) > _DEEPEST:
                raise ModelFormatError(common.offset, "an object is its own ancestor", "a tree")
            way.append(at)
            at = by_handle[at][1].parent
        start = depth.get(at, -1)
        depth.update({handle: start + k for k, handle in enumerate(reversed(way), 1)})
    return sorted(found, key=lambda read: depth[read[1].handle])


def _make(
    tag: str, own: Section, flags: int, shared: Resources, fields: dict[str, Any]
) -> tuple[SceneObject, int]:
    """The object, and the handle of the dummy it is linked with (-1 for none)."""
    if tag == "SHP":
        dynamic, contacts = objects.dynamic_allowed(flags), objects.contacts_allowed(flags)
        return read_shape(own, shared, dynamic, contacts, fields), -1
    if tag == "JNT":
        return objects.read_joint(own, objects.dynamic_allowed(flags), fields), -1
    if tag == "DMY":
        return objects.read_dummy(own, fields)
    kinds: dict[str, Callable[[Section, dict[str, Any]], SceneObject]]
    kinds = {"SNR": objects.read_sensor, "FSE": objects.read_force_sensor, "PAT": objects.read_path}
    return kinds.get(tag, objects.read_other)(own, fields), -1
