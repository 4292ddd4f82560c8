"""Where on a picture the corners of triangles lie."""

from dataclasses import dataclass

import numpy as np

from imop.errors import ModelFormatError
from imop.geometry import se3
from imop.tasks.coppelia.model import Texture
from imop.tasks.coppelia.sections import Section
from imop.types import Float32Array, FloatArray, IntArray

_LARGEST_SIDE = 8192


def read_texture(section: Section) -> tuple[int, Texture]:
    """The id and the picture of a TEX section."""
    head = section.require("Ipa")
    number, width, height = (int(i) for i in head.ints(3))
    if not (0 < width <= _LARGEST_SIDE and 0 < height <= _LARGEST_SIDE):
        raise ModelFormatError(head.at, f"a picture of {width} x {height}", f"sides of 1 .. {_LARGEST_SIDE}")
    channels = 4 if section.flags("Bst") & 1 else 3
    image = section.require("Img")
    start, raw = image.at, image.rest32("u1")
    if len(raw) != width * height * channels:
        raise ModelFormatError(start, f"{len(raw)} bytes of picture", f"{width * height * channels}")
    pixels = raw.reshape(height, width, channels)[:, :, :3].astype(np.uint8)
    return number, Texture(section.text("Gon"), pixels)


@dataclass(frozen=True, eq=False)
class TextureUse:
    """How a mesh carries a picture.

    Attributes:
        texture: id.
        mapping: 0 plane, 1 cylinder, 2 sphere, 3 cube.
        scale: (x, y) metres of one picture.
        T_mesh_texture: (4, 4).
        corners: (t, 3, 2) given, which win over the mapping; empty for none.
        decal: whether the picture replaces the mesh's colour instead of tinting it.
    """

    texture: int
    mapping: int
    scale: tuple[float, float]
    T_mesh_texture: FloatArray
    corners: Float32Array
    decal: bool


def read_texture_use(section: Section, triangles: int) -> TextureUse:
    """A Toj section of a mesh with so many triangles."""
    body = section.require("Tob")
    number, mapping = (int(i) for i in body.ints(2))
    x, y = body.floats(2)
    pose, given, apply = section.get("Trc"), section.get("Ftc"), section.get("Apm")
    T = np.eye(4) if pose is None else pose.pose(position_first=False)
    corners = np.zeros(0, np.float32) if given is None else given.finite32()
    if corners.size not in (0, 6 * triangles):
        raise ModelFormatError(section.start, f"{corners.size} texture coordinates", f"0 or {6 * triangles}")
    decal = apply is not None and apply.one_int() == 1
    return TextureUse(number, mapping, (float(x), float(y)), T, corners.reshape(-1, 3, 2), decal)


def coordinates(
    use: TextureUse, picture: Texture, vertices: Float32Array, triangles: IntArray
) -> Float32Array:
    """(t, 3, 2) u and v of the triangles' corners, any number of pictures along."""
    if len(use.corners):
        return use.corners
    p = se3.apply(se3.invert(use.T_mesh_texture), vertices.astype(np.float64))[triangles]
    height, width = picture.pixels.shape[:2]
    aspect = (1.0, height / width) if width >= height else (width / height, 1.0)
    sx, sy = (s if abs(s) > 1e-9 else 1.0 for s in use.scale)
    if use.mapping in (0, 3):
        first, second = (0, 1) if use.mapping == 0 else _cube_axes(p)
        u, v = (
            np.take_along_axis(p, np.broadcast_to(a, p.shape[:2])[..., None], 2)[..., 0]
            for a in (first, second)
        )
        uv = np.stack([u / (sx * aspect[0]) + 0.5, v / (sy * aspect[1]) + 0.5], axis=-1)
    else:
        u = _seamless((np.arctan2(p[..., 1], p[..., 0]) / np.pi + 1) / 2, p)
        if use.mapping == 1:
            v = p[..., 2] / sy * aspect[1] + 0.5
        else:
            length = np.maximum(np.linalg.norm(p, axis=-1), 1e-12)
            v = 1 - np.arccos(np.clip(p[..., 2] / length, -1, 1)) / np.pi
        uv = np.stack([u, v], axis=-1)
    return uv.astype(np.float32)


def _cube_axes(p: FloatArray) -> tuple[IntArray, IntArray]:
    """(t, 1) twice: the axes across the one that each triangle's normal is nearest to."""
    normal = np.abs(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]))
    along = np.argmax(normal, axis=1).astype(np.int32)[:, None]
    return (along + 1) % 3, (along + 2) % 3


def _seamless(u: FloatArray, p: FloatArray) -> FloatArray:
    """Turn u (t, 3) so that no triangle reaches once around; corners on the axis take the others' mean."""
    u = u + (u < u.max(axis=1, keepdims=True) - 0.5)
    radius = np.linalg.norm(p[..., :2], axis=-1)
    on_axis = radius < 1e-6 * np.maximum(np.abs(p).max(), 1e-9)
    others = np.where(on_axis, 0, u).sum(axis=1) / np.maximum((~on_axis).sum(axis=1), 1)
    seamless: FloatArray = np.where(on_axis, others[:, None], u)
    return seamless
