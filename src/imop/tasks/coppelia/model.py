"""What a model file says: a tree of named objects, typed.

Metres, radians, kilograms. The world pose of an object is the product, root first, of every ancestor's pose
in its parent and, if the ancestor is a joint, of the joint's motion, and then of its own pose.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.types import ByteArray, Float32Array, FloatArray, IntArray

Primitive = Literal["plane", "disc", "cuboid", "spheroid", "cylinder", "cone", "heightfield", "capsule"]


@dataclass(frozen=True, eq=False, kw_only=True)
class SceneObject:
    """Any object of the tree; also those that are nothing but a frame to us, as cameras and lights.

    Attributes:
        name: unique in the model.
        parent: index of the parent in `Model.objects`, -1 for none; parents come first.
        T_parent_object: (4, 4); the parent of a joint's child is the joint's moved frame.
        extension: RLBench's words on a waypoint.
        shown: whether it lies on a layer that the program shows.
        collidable: whether motion planning avoids it.
        renderable: said by the file, and no guide to what is seen: see `convert`.
        model_base: whether it is the root of a model, whose box counts as one.
        hidden_in_box: whether the model's bounding box leaves it out.
    """

    name: str
    parent: int
    T_parent_object: FloatArray
    extension: str = ""
    shown: bool = True
    collidable: bool = False
    renderable: bool = True
    model_base: bool = False
    hidden_in_box: bool = False


@dataclass(frozen=True, eq=False, kw_only=True)
class Dummy(SceneObject):
    """A frame; `linked` is the index of a dummy that it shall stay with, -1 for none."""

    size: float = 0.01
    linked: int = -1


@dataclass(frozen=True, eq=False, kw_only=True)
class ForceSensor(SceneObject):
    """A rigid link."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Joint(SceneObject):
    """One degree of freedom along or about its z axis, or three about its origin.

    Attributes:
        kind: revolute, prismatic or spherical.
        position: in the file, radians or metres.
        orientation: (4,) quaternion xyzw of a spherical joint.
        limits: lowest and highest position, None for a cyclic joint.
        lead: metres that a screw advances per radian.
        dynamic: whether forces move it; otherwise it stays where it is put.
        motor: how it is driven: by nothing, to `target_velocity`, to `target_position` stiffly, or by a
            spring of `stiffness` and `damping` to `target_position`; always with at most `max_force`.
        max_force: N or N m.
        size: drawn length and diameter.
    """

    kind: Literal["revolute", "prismatic", "spherical"]
    position: float
    orientation: FloatArray
    limits: tuple[float, float] | None
    lead: float
    dynamic: bool
    motor: Literal["off", "velocity", "position", "spring"]
    target_velocity: float
    target_position: float
    max_force: float
    stiffness: float
    damping: float
    size: tuple[float, float]

    @property
    def T_motion(self) -> FloatArray:
        """(4, 4) the moved frame in the joint's own."""
        if self.kind == "spherical":
            return se3.make(Rotation.from_quat(self.orientation).as_matrix())
        if self.kind == "prismatic":
            return se3.make(p=(0.0, 0.0, self.position))
        return se3.make(se3.euler(z=self.position), (0.0, 0.0, self.lead * self.position))


@dataclass(frozen=True, eq=False, kw_only=True)
class ProximitySensor(SceneObject):
    """Detects surfaces that pass through its volume, which begins `offset` along its z axis.

    Attributes:
        kind: of volume.
        offset: metres from the origin to the near end.
        range: metres from the near to the far end.
        near: half sizes (x, y) of the near end; the radius twice for round volumes.
        far: half sizes of the far end.
        front_faces: whether surfaces that look towards the sensor count.
        back_faces: whether the others count.
    """

    kind: Literal["pyramid", "cylinder", "disc", "cone", "ray"]
    offset: float
    range: float
    near: tuple[float, float]
    far: tuple[float, float]
    front_faces: bool
    back_faces: bool


@dataclass(frozen=True, eq=False, kw_only=True)
class PathObject(SceneObject):
    """A curve.

    Attributes:
        T_path_points: (n, 4, 4) corners of the polyline, in the object's frame.
        closed: whether the last point is followed by the first.
    """

    T_path_points: FloatArray
    closed: bool


@dataclass(frozen=True, eq=False)
class Texture:
    """A picture; `pixels` (h, w, 3) uint8, its first row is at v = 0, the lower border."""

    name: str
    pixels: ByteArray


@dataclass(frozen=True, eq=False)
class Piece:
    """One mesh of a shape.

    Attributes:
        primitive: what the mesh is made of, None for a mesh of its own.
        size: full sizes x, y, z of the primitive, which is centred on and aligned with the mesh's frame.
        T_shape_mesh: (4, 4).
        vertices: (v, 3) in the mesh's frame.
        triangles: (t, 3).
        color: red, green, blue, 0 .. 1.
        opacity: 1 unless transparent.
        wireframe: drawn as lines only, as the borders of areas are.
        convex: said by the file.
        texture: id of the picture, None for none.
        uv: (t, 3, 2) of the triangles' corners if there is a texture.
    """

    primitive: Primitive | None
    size: tuple[float, float, float]
    T_shape_mesh: FloatArray
    vertices: Float32Array
    triangles: IntArray
    color: tuple[float, float, float]
    opacity: float = 1.0
    wireframe: bool = False
    convex: bool = False
    texture: int | None = None
    uv: Float32Array | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class Shape(SceneObject):
    """Something solid, or drawn.

    Attributes:
        pieces: one, or several of a compound.
        mass: kg.
        T_shape_inertia: (4, 4) centre of mass and principal axes.
        moments: (3,) principal moments, kg m2.
        dynamic: moved by forces; otherwise it stays on its parent.
        respondable: whether others bump into it.
        mask: bits 0-7 for contacts within a tree, 8-15 for all others; two shapes touch if they share one.
        friction: coefficient.
    """

    pieces: tuple[Piece, ...]
    mass: float
    T_shape_inertia: FloatArray
    moments: FloatArray
    dynamic: bool
    respondable: bool
    mask: int = 0xFFFF
    friction: float = 0.7

    @cached_property
    def corners(self) -> FloatArray:
        """(t, 3, 3) corners of all triangles in the shape's frame."""
        parts = [se3.apply(p.T_shape_mesh, p.vertices[p.triangles].astype(np.float64)) for p in self.pieces]
        return np.concatenate(parts) if parts else np.zeros((0, 3, 3))

    @cached_property
    def ball(self) -> tuple[FloatArray, float]:
        """Center (3,) in the shape's frame and radius of a ball that all corners lie in."""
        points = self.corners.reshape(-1, 3)
        if len(points) == 0:
            return np.zeros(3), 0.0
        center: FloatArray = (points.min(axis=0) + points.max(axis=0)) / 2
        return center, float(np.linalg.norm(points - center, axis=1).max())


@dataclass(frozen=True, eq=False)
class Model:
    """A whole file.

    Attributes:
        objects: parents before their children.
        textures: id -> picture.
    """

    objects: tuple[SceneObject, ...]
    textures: dict[int, Texture]

    @cached_property
    def index(self) -> dict[str, int]:
        """Name -> place in `objects`."""
        return {o.name: i for i, o in enumerate(self.objects)}

    def __getitem__(self, name: str) -> SceneObject:
        if name not in self.index:
            raise InvalidInput("object", name, "one of " + ", ".join(self.index))
        return self.objects[self.index[name]]

    @cached_property
    def T_world_moved(self) -> FloatArray:
        """(objects, 4, 4) the frames that children hang in; for all but joints that of the object itself."""
        frames = np.zeros((len(self.objects), 4, 4))
        for i, o in enumerate(self.objects):
            T = o.T_parent_object if o.parent < 0 else frames[o.parent] @ o.T_parent_object
            frames[i] = T @ o.T_motion if isinstance(o, Joint) else T
        return frames

    def T_world(self, name: str) -> FloatArray:
        """(4, 4) pose of an object in the file; for a joint before its motion.

        Raises:
            InvalidInput: if there is no such object.
        """
        o = self[name]
        T: FloatArray = o.T_parent_object
        return T if o.parent < 0 else self.T_world_moved[o.parent] @ T

    @cached_property
    def children(self) -> Sequence[Sequence[int]]:
        """For every object the indices of its children."""
        found: list[list[int]] = [[] for _ in self.objects]
        for i, o in enumerate(self.objects):
            if o.parent >= 0:
                found[o.parent].append(i)
        return found

    def subtree(self, i: int) -> list[int]:
        """Object `i` and all below it, parents first."""
        return [i, *(k for child in self.children[i] for k in self.subtree(child))]
