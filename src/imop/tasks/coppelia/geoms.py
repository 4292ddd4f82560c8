"""Pieces of shapes as MuJoCo geometry: what is seen, and what others bump into."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import mujoco
import numpy as np
from scipy.spatial import ConvexHull

from imop.geometry import se3
from imop.tasks.coppelia.model import Model, Piece, Shape
from imop.tasks.coppelia.parts import convex_parts, is_convex
from imop.types import FloatArray

SEEN_GROUP, UNSEEN_GROUP = 0, 3
_HELPERS = ("stopper", "boundary", "_resp")
"""Words in the names of shapes that are only there for the physics, if the file calls them not renderable."""
_THIN = 0.0005
"""Half the thickness that collision geometry gets where it has none, metres."""
_SMALLEST_AREA = 1e-14
"""Of a triangle, m2."""
_LARGEST_PICTURE = 512
_CLEAR = 0.1
"""Opacity below which something is not drawn."""
_HULL_VERTICES = 64


def is_drawn(shape: Shape, piece: Piece) -> bool:
    """Whether cameras see a piece. The file's `renderable` is clear on much that is seen, so names decide."""
    helper = not shape.renderable and any(word in shape.name for word in _HELPERS)
    return shape.shown and not piece.wireframe and not helper and piece.opacity > _CLEAR


@dataclass
class Assets:
    """Meshes and pictures that a scene already has; pieces that share arrays share them."""

    spec: Any
    model: Model
    prefix: str
    meshes: dict[tuple[int, int, int, bool], str] = field(default_factory=dict)
    materials: dict[int, str] = field(default_factory=dict)
    joined: dict[Any, Piece] = field(default_factory=dict)
    apart: dict[tuple[int, int], list[Piece]] = field(default_factory=dict)

    def parts(self, piece: Piece) -> list[Piece]:
        """Convex pieces that fill a piece: itself, or the parts of a mesh that is not convex.

        Raises:
            MissingExtra: if there are parts to be made and coacd is not installed.
        """
        key = (id(piece.vertices), id(piece.triangles))
        if key not in self.apart:
            corners = [] if is_convex(piece) else convex_parts(piece)
            self.apart[key] = [_solid(points) for points in corners] or [piece]
        return self.apart[key]

    def mesh(self, piece: Piece, hull: bool) -> str | None:
        """Name of the piece's mesh, None if it has no surface; with `hull` only its convex hull counts."""
        key = (id(piece.vertices), id(piece.triangles), id(piece.uv), hull)
        if key in self.meshes:
            return self.meshes[key]
        corners = piece.vertices.astype(np.float64)[piece.triangles]
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        kept = piece.triangles[area > 2 * _SMALLEST_AREA]
        if len(kept) == 0:
            return None
        name = f"{self.prefix}mesh{len(self.meshes)}"
        used, faces = np.unique(kept, return_inverse=True)
        points = _thickened(piece.vertices[used]) if hull else _four(piece.vertices[used])
        options: dict[str, Any] = {"maxhullvert": _HULL_VERTICES} if hull else {}
        if piece.uv is not None and not hull:
            options["usertexcoord"] = piece.uv[area > 2 * _SMALLEST_AREA].reshape(-1).astype(np.float32)
            options["userfacetexcoord"] = np.arange(3 * len(kept), dtype=np.int32)
        self.spec.add_mesh(
            name=name,
            uservert=points.reshape(-1),
            userface=faces.astype(np.int32).reshape(-1),
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
            if hull
            else mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
            **options,
        )
        self.meshes[key] = name
        return name

    def material(self, picture: int) -> str:
        """Name of the material that carries a picture."""
        if picture not in self.materials:
            name = f"{self.prefix}picture{len(self.materials)}"
            pixels = self.model.textures[picture].pixels
            step = int(np.ceil(max(pixels.shape[:2]) / _LARGEST_PICTURE))
            small = _averaged(pixels, step)
            texture = self.spec.add_texture(name=name, type=mujoco.mjtTexture.mjTEXTURE_2D, nchannel=3)
            texture.height, texture.width = small.shape[:2]
            texture.data = small.tobytes()
            material = self.spec.add_material(name=name, rgba=[1, 1, 1, 1])
            material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name
            self.materials[picture] = name
        return self.materials[picture]


def _solid(corners: FloatArray) -> Piece:
    """The hull of corners (n, 3), not drawn."""
    return Piece(
        primitive=None,
        size=(0.0, 0.0, 0.0),
        T_shape_mesh=np.eye(4),
        vertices=corners.astype(np.float32),
        triangles=ConvexHull(corners).simplices.astype(np.int32),
        color=(0.0, 0.0, 0.0),
    )


def _averaged(pixels: Any, step: int) -> Any:
    """The picture (h, w, 3) with squares of `step` pixels averaged to one."""
    h, w = (max(1, n // step) for n in pixels.shape[:2])
    cut = pixels[: h * step, : w * step].astype(np.float64)
    return np.round(cut.reshape(h, step, w, step, 3).mean(axis=(1, 3))).astype(np.uint8)


def _four(vertices: Any) -> Any:
    """Vertices, at least the four that MuJoCo demands."""
    return vertices if len(vertices) > 3 else np.concatenate([vertices, vertices[:1]])


def _thickened(vertices: Any) -> FloatArray:
    """Vertices whose hull has a volume: those of flat pieces are doubled across the plane."""
    points = vertices.astype(np.float64)
    centred = points - points.mean(axis=0)
    normal = np.linalg.svd(centred, full_matrices=False)[2][-1] if len(points) > 2 else np.array([0, 0, 1.0])
    along = centred @ normal
    if along.max() - along.min() >= 2 * _THIN and len(points) > 3:
        thick: FloatArray = points
    else:
        thick = np.concatenate([points - _THIN * normal, points + _THIN * normal])
    return thick


def add_geoms(assets: Assets, body: Any, shape: Shape) -> None:
    """Give `body`, whose frame is the shape's, everything of the shape that is seen or solid."""
    name = f"{assets.prefix}{shape.name}"
    meshes: list[Piece] = []
    for k, piece in enumerate(shape.pieces):
        drawn = is_drawn(shape, piece)
        primitive = _primitive(piece, solid=shape.respondable)
        if drawn and piece.uv is None and primitive is not None:
            _add(body, piece, primitive, f"{name}:{k}", shape, drawn=True, solid=shape.respondable)
            continue
        if drawn:
            meshes.append(piece)
        if shape.respondable:
            for j, solid in enumerate([primitive] if primitive else _hulls(assets, piece)):
                _add(body, piece, solid, f"{name}:{k}:solid{j or ''}", shape, drawn=False, solid=True)
    for k, piece in enumerate(_joined(assets, meshes)):
        mesh = assets.mesh(piece, hull=False)
        if mesh is not None:
            options = {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": mesh}
            if piece.texture is not None:
                options["material"] = assets.material(piece.texture)
            _add(body, piece, options, f"{name}:mesh{k}", shape, drawn=True, solid=False)


def _joined(assets: Assets, pieces: list[Piece]) -> list[Piece]:
    """The pieces, those of one colour and picture joined; rays take time for every geometry.

    Compounds of the same arrays, as of equal mugs, are joined once.
    """
    alike: dict[Any, list[Piece]] = {}
    for piece in pieces:
        alike.setdefault((piece.color, piece.texture), []).append(piece)
    found = []
    for group in alike.values():
        key = tuple((id(p.vertices), id(p.triangles), id(p.uv), p.T_shape_mesh.tobytes()) for p in group)
        if len(group) > 1 and key not in assets.joined:
            assets.joined[key] = _join(group)
        found.append(assets.joined[key] if len(group) > 1 else group[0])
    return found


def _join(pieces: list[Piece]) -> Piece:
    """One piece, in the shape's frame."""
    points = [se3.apply(p.T_shape_mesh, p.vertices.astype(np.float64)) for p in pieces]
    first = np.cumsum([0, *(len(p) for p in points[:-1])])
    uv = [p.uv for p in pieces if p.uv is not None]
    return replace(
        pieces[0],
        T_shape_mesh=np.eye(4),
        vertices=np.concatenate(points).astype(np.float32),
        triangles=np.concatenate([p.triangles + n for p, n in zip(pieces, first, strict=True)]).astype(
            np.int32
        ),
        uv=np.concatenate(uv) if uv else None,
    )


def _hulls(assets: Assets, piece: Piece) -> list[dict[str, Any]]:
    meshes = [assets.mesh(part, hull=True) for part in assets.parts(piece)]
    return [{"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": mesh} for mesh in meshes if mesh is not None]


def _primitive(piece: Piece, solid: bool) -> dict[str, Any] | None:
    """MuJoCo's geometry of a primitive, half sizes; None if only a mesh will do."""
    half = np.asarray(piece.size) / 2
    least = np.maximum(half, _THIN if solid else 1e-5)
    x, y, z = (float(v) for v in least)
    if piece.primitive == "plane":
        return {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": [x, y, _THIN if solid else 1e-4]}
    if piece.primitive == "cuboid":
        return {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": [x, y, z]}
    if piece.primitive == "spheroid":
        return (
            {"type": mujoco.mjtGeom.mjGEOM_ELLIPSOID, "size": [x, y, z]}
            if np.ptp(half) > 1e-6
            else {"type": mujoco.mjtGeom.mjGEOM_SPHERE, "size": [x, 0, 0]}
        )
    if piece.primitive in ("cylinder", "disc") and abs(half[0] - half[1]) < 1e-6:
        return {
            "type": mujoco.mjtGeom.mjGEOM_CYLINDER,
            "size": [x, z if piece.primitive == "cylinder" else _THIN, 0],
        }
    if piece.primitive == "capsule" and z > x:
        return {"type": mujoco.mjtGeom.mjGEOM_CAPSULE, "size": [x, z - x, 0]}
    return None


def own_color(rgb: Sequence[float]) -> list[float]:
    """A colour (0 .. 1) as a geometry may carry it: MuJoCo reads exactly one grey as "the material's"."""
    return [0.501 if abs(c - 0.5) < 1e-3 else c for c in rgb]


def _add(
    body: Any, piece: Piece, options: dict[str, Any], name: str, shape: Shape, drawn: bool, solid: bool
) -> None:
    T = piece.T_shape_mesh
    body.add_geom(
        name=name,
        pos=T[:3, 3],
        quat=se3.to_wxyz(T),
        rgba=[*own_color(piece.color), 1.0],
        group=SEEN_GROUP if drawn else UNSEEN_GROUP,
        contype=int(solid),
        conaffinity=int(solid),
        friction=[shape.friction, 0.005, 0.0001],
        mass=0,
        **options,
    )
