"""Shapes: single meshes and compounds, their colours, pictures and masses."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from imop.errors import ModelFormatError
from imop.tasks.coppelia.arrays import SharedArrays
from imop.tasks.coppelia.model import Piece, Primitive, Shape, Texture
from imop.tasks.coppelia.sections import Section, Values, read_section
from imop.tasks.coppelia.texture import TextureUse, coordinates, read_texture_use
from imop.types import FloatArray

_PRIMITIVES: tuple[Primitive | None, ...]
_PRIMITIVES = (None, "plane", "disc", "cuboid", "spheroid", "cylinder", "cone", "heightfield", "capsule")
_DEEPEST = 30
_GREY = (0.75, 0.75, 0.75)
_DEFAULT_FRICTION = 0.71
_LARGEST_FRICTION = 100.0


@dataclass(frozen=True, eq=False)
class Resources:
    """What the shapes of a file share."""

    arrays: SharedArrays
    textures: dict[int, Texture]


def read_shape(
    section: Section, shared: Resources, dynamic: bool, contacts: bool, fields: dict[str, Any]
) -> Shape:
    """The own part of a shape, as far as its model lets it be dynamic and respondable."""
    geometry = section.inner("Ge2")
    values = None if geometry is None else geometry.get("Gst") or geometry.get("Gsg")
    if geometry is None or values is None:
        raise ModelFormatError(section.start, "a shape without geometry", "an item Ge2 with Gst or Gsg")
    wrapper, end = read_section(values.body, values.at, values.end)
    pieces = _leaf(values, end, shared) if geometry.get("Gst") else _compound(wrapper, shared, 0)
    mass = float(wrapper.require("Mas").one_float())
    inertia = wrapper.require("Ine")
    T = inertia.pose(position_first=True)
    moments = np.abs(mass * inertia.floats(3))
    mask = section.get("Dc2")
    return Shape(
        pieces=tuple(pieces),
        mass=abs(mass),
        T_shape_inertia=T,
        moments=moments,
        dynamic=dynamic and bool(section.flags("Sss") & 0x80),
        respondable=contacts and bool((section.get("Ss3") or _none(section)).u8() & 1),
        mask=0xFFFF if mask is None else mask.u16(),
        friction=_friction(section),
        **fields,
    )


def _none(section: Section) -> Values:
    return section.get("Ss2") or Values(b"\0", 0, 1)


def _friction(section: Section) -> float:
    material = section.inner("Mat")
    values = None if material is None else material.get("BuN")
    if values is None:
        return _DEFAULT_FRICTION
    n, _ = values.ints(2)
    found = values.floats(int(n))
    return float(np.clip(found[2], 0, _LARGEST_FRICTION)) if len(found) > 2 else _DEFAULT_FRICTION


def _compound(wrapper: Section, shared: Resources, depth: int) -> list[Piece]:
    if depth > _DEEPEST:
        raise ModelFormatError(wrapper.start, "compounds within compounds", f"at most {_DEEPEST}")
    pieces: list[Piece] = []
    for tag, start, end in wrapper.items:
        if tag in ("Geo", "Wrp"):
            inner, after = read_section(wrapper.body, start, end)
            values = Values(wrapper.body, start, end)
            pieces += _leaf(values, after, shared) if tag == "Geo" else _compound(inner, shared, depth + 1)
    return pieces


def _leaf(values: Values, start: int, shared: Resources) -> list[Piece]:
    mesh, _ = read_section(values.body, start, values.end)
    return [_read_mesh(mesh, shared)]


def _read_mesh(mesh: Section, shared: Resources) -> Piece:
    kind = mesh.require("Ppr")
    primitive = _PRIMITIVES[kind.count(len(_PRIMITIVES) - 1)]
    x, y, z = (float(abs(s)) for s in kind.floats(3))
    arrays, lists = SharedArrays(mesh), (0, 0)
    if mesh.get("Ver") is None:
        arrays, lists = shared.arrays, (mesh.require("Vev").one_int(), mesh.require("Inv").one_int())
    vertices, triangles = arrays.mesh(*lists, mesh.start)
    color, opacity = _read_color(mesh.inner("Cl0"))
    use = mesh.inner("Toj")
    picture = None if use is None else read_texture_use(use, len(triangles))
    known = picture is not None and picture.texture in shared.textures
    return Piece(
        primitive=primitive,
        size=(x, y, z),
        T_shape_mesh=mesh.require("Ppf").pose(position_first=True),
        vertices=vertices,
        triangles=triangles,
        color=(1.0, 1.0, 1.0) if known and picture is not None and picture.decal else color,
        opacity=opacity,
        wireframe=bool(mesh.flags("Var") & 4),
        convex=bool(mesh.flags("Va2") & 1),
        texture=picture.texture if known and picture is not None else None,
        uv=_uv(picture, shared, vertices, triangles) if known and picture is not None else None,
    )


def _uv(use: TextureUse, shared: Resources, vertices: Any, triangles: Any) -> Any:
    return coordinates(use, shared.textures[use.texture], vertices, triangles)


def _read_color(section: Section | None) -> tuple[tuple[float, float, float], float]:
    if section is None:
        return _GREY, 1.0
    # An older duplicate counts only where the newer item is missing.
    values = section.get("Cl3") or section.get("Cl2")
    rgb: FloatArray = np.array(_GREY) if values is None else np.clip(values.floats(3), 0, 1)
    opacity, transparent = section.get("Trf"), not section.flags("Var") & 4
    has_flags = section.get("Var") is not None
    alpha = opacity.one_float() if opacity is not None and transparent and has_flags else 1.0
    return (float(rgb[0]), float(rgb[1]), float(rgb[2])), float(np.clip(alpha, 0, 1))
