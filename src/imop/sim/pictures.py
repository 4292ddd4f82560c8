"""Pictures on meshes: the colour of a texture where a ray met the surface.

Rays tell the geometry and the point, not the triangle. The nearest of points sown over the mesh, with a
normal like the ray's, tells the triangle, whose corners' texture coordinates are then interpolated exactly.
"""

from functools import cached_property
from typing import Any

import mujoco
import numpy as np
from scipy.spatial import cKDTree

from imop.types import FloatArray, IntArray

_SPACING = 0.004
"""Metres between points of large triangles; smaller triangles have one each."""
_MOST = 60_000
_NORMAL_WEIGHT = 0.02
"""Metres that two points with opposite normals seem to be apart by, half of it; the sides of a thin sheet."""


class MeshPicture:
    """A mesh of the model with a texture on it.

    Args:
        model: MjModel.
        geom: number of a geometry of the mesh, with a material that has a texture.
    """

    def __init__(self, model: Any, geom: int):
        mesh = int(model.geom_dataid[geom])
        faces = _part(model.mesh_face, model.mesh_faceadr, model.mesh_facenum, mesh)
        vertices = _part(model.mesh_vert, model.mesh_vertadr, model.mesh_vertnum, mesh).astype(np.float64)
        self._corners: FloatArray = vertices[faces]
        uv = _part(model.mesh_texcoord, model.mesh_texcoordadr, model.mesh_texcoordnum, mesh)
        indices = _part(model.mesh_facetexcoord, model.mesh_faceadr, model.mesh_facenum, mesh)
        self._uv: FloatArray = uv[indices].astype(np.float64)
        self._pixels = _pixels(model, int(_texture(model, geom)))

    @cached_property
    def _tree(self) -> tuple[cKDTree, IntArray]:
        """The points sown, with their normals, and the triangle of each."""
        a, b, c = (self._corners[:, i] for i in range(3))
        normal = np.cross(b - a, c - a)
        area = np.linalg.norm(normal, axis=1)
        normal /= np.maximum(area, 1e-15)[:, None]
        wanted = np.ceil(area / 2 / _SPACING**2)
        many = max(1.0, wanted.sum() / _MOST)
        n = np.maximum(1, wanted / many).astype(np.int64)
        triangle = np.repeat(np.arange(len(n)), n)
        # A low-discrepancy sequence folded into the triangle spreads evenly; its first point is the middle.
        k = np.arange(len(triangle)) - np.repeat(np.cumsum(n) - n, n)
        s, t = (1 / 3 + 0.7548776662466927 * k) % 1.0, (1 / 3 + 0.5698402909980532 * k) % 1.0
        outside = s + t > 1
        s, t = np.where(outside, 1 - s, s)[:, None], np.where(outside, 1 - t, t)[:, None]
        points = a[triangle] + s * (b - a)[triangle] + t * (c - a)[triangle]
        key = np.concatenate([points, _NORMAL_WEIGHT * normal[triangle]], axis=1)
        return cKDTree(key), triangle.astype(np.int32)

    def colors(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """(n, 3) red, green, blue, 0 .. 1, at points (n, 3) with unit normals (n, 3) in the geom's frame."""
        tree, triangle = self._tree
        key = np.concatenate([points, _NORMAL_WEIGHT * normals], axis=1)
        hit = triangle[tree.query(key)[1]]
        weights = _barycentric(self._corners[hit], points)
        u, v = np.einsum("ni,nij->jn", weights, self._uv[hit])
        height, width = self._pixels.shape[:2]
        row = np.floor(v * height).astype(np.int64) % height
        column = np.floor(u * width).astype(np.int64) % width
        found: FloatArray = self._pixels[row, column] / 255.0
        return found


def _barycentric(corners: FloatArray, points: FloatArray) -> FloatArray:
    """(n, 3) weights of the triangles' corners (n, 3, 3) at the points' projections, none negative."""
    a, b, c = (corners[:, i] for i in range(3))
    u, v, w = b - a, c - a, points - a
    uu, uv, vv = (np.einsum("ni,ni->n", *pair) for pair in ((u, u), (u, v), (v, v)))
    wu, wv = np.einsum("ni,ni->n", w, u), np.einsum("ni,ni->n", w, v)
    scale = np.maximum(uu * vv - uv * uv, 1e-30)
    s, t = (vv * wu - uv * wv) / scale, (uu * wv - uv * wu) / scale
    weights = np.clip(np.stack([1 - s - t, s, t], axis=1), 0.0, None)
    normalised: FloatArray = weights / np.maximum(weights.sum(axis=1, keepdims=True), 1e-12)
    return normalised


def _part(values: Any, starts: Any, counts: Any, i: int) -> Any:
    return values[starts[i] : starts[i] + counts[i]]


def _texture(model: Any, geom: int) -> int:
    """Number of the texture on a geometry, -1 for none."""
    material = int(model.geom_matid[geom])
    if material < 0:
        return -1
    return int(model.mat_texid[material, mujoco.mjtTextureRole.mjTEXROLE_RGB])


def _pixels(model: Any, texture: int) -> Any:
    """(h, w, 3) uint8; the first row is at v = 0."""
    height, width = int(model.tex_height[texture]), int(model.tex_width[texture])
    channels, start = int(model.tex_nchannel[texture]), int(model.tex_adr[texture])
    flat = model.tex_data[start : start + height * width * channels]
    return flat.reshape(height, width, channels)[:, :, :3]


def find_pictures(model: Any) -> dict[int, MeshPicture]:
    """The pictures of a model: geometry -> picture. Geometries that share mesh and material share it."""
    found: dict[tuple[int, int], MeshPicture] = {}
    pictures: dict[int, MeshPicture] = {}
    for geom in np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_MESH):
        mesh = int(model.geom_dataid[geom])
        if _texture(model, int(geom)) >= 0 and model.mesh_texcoordnum[mesh] > 0:
            key = (mesh, int(model.geom_matid[geom]))
            if key not in found:
                found[key] = MeshPicture(model, int(geom))
            pictures[int(geom)] = found[key]
    return pictures
