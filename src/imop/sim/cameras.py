"""Cameras drawn with rays: colour, depth and instance ids without OpenGL. RLBench's four, and a pair of D415.

Camera frames are OpenCV's: x right, y down, z forward. Pixel (u, v) looks along inv(K) (u, v, 1), so depth is
measured along the optical axis. Nothing hit, or farther than the far plane, is depth 0 and instance 0.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.sim.world import World
from imop.types import ByteArray, CameraView, Float32Array, FloatArray, IntArray, Observation

BACKGROUND = np.array([0.0, 41 / 255, 47 / 255])
VISIBLE_GROUPS = np.array([1, 1, 1, 0, 0, 0], dtype=np.uint8)
"""Geometry groups that cameras see, as in MuJoCo's own viewer."""
UNSET_RGBA = (0.5, 0.5, 0.5, 1.0)
LAMP_DIRECTION = np.array([0.35, 0.2, 0.91]) / np.linalg.norm([0.35, 0.2, 0.91])
AMBIENT, HEADLIGHT, LAMP = 0.45, 0.30, 0.30


@dataclass(frozen=True, eq=False)
class Camera:
    """A pinhole camera with square pixels.

    Attributes:
        T_mount_camera: (4, 4) pose in the world, or in the gripper's tip frame when `on_gripper`.
        field_of_view: vertical, radians.
        far: metres; what lies beyond is not measured.
        on_gripper: whether the camera moves with the gripper.
        size: width and height of its images, pixels; None if it takes any that are asked for.
    """

    T_mount_camera: FloatArray
    field_of_view: float
    far: float
    on_gripper: bool = False
    size: tuple[int, int] | None = None

    def intrinsics(self, width: int, height: int) -> FloatArray:
        """(3, 3) pixels; the principal point is (width / 2, height / 2)."""
        f = height / 2 / np.tan(self.field_of_view / 2)
        return np.array([[f, 0, width / 2], [0, f, height / 2], [0, 0, 1]])

    def T_world_camera(self, world: World) -> FloatArray:
        """Where the camera is now (4, 4)."""
        return world.T_world_gripper @ self.T_mount_camera if self.on_gripper else self.T_mount_camera


def _from_rlbench(R_mount_recorded: FloatArray, position: tuple[float, float, float]) -> FloatArray:
    # Recorded frames have x to the image's left and y up.
    return se3.make(R_mount_recorded @ np.diag([-1.0, -1.0, 1.0]), position)


def _fixed(position: tuple[float, float, float], quaternion_wxyz: tuple[float, ...], far: float) -> Camera:
    R = se3.from_wxyz(np.array(quaternion_wxyz))
    return Camera(_from_rlbench(R, position), np.radians(40.0), far)


_WRIST_R = np.array([[0, -0.996195, 0.087155], [1, 0, 0], [0, 0.087155, 0.996195]])

CAMERAS: dict[str, Camera] = {
    "front": _fixed((1.35, 0.0, 1.58), (0.379928, 0.596368, -0.596368, -0.379928), 4.5),
    "left_shoulder": _fixed((-0.175, 0.2, 1.98), (0.165802, 0.747887, 0.627551, 0.139125), 3.2),
    "right_shoulder": _fixed((-0.175, -0.2, 1.98), (0.139125, 0.627552, 0.747887, 0.165803), 3.2),
    "wrist": Camera(
        _from_rlbench(Rotation.from_matrix(_WRIST_R).as_matrix(), (-0.05, 0.002, -0.0921)),
        np.radians(60.0),
        3.5,
        on_gripper=True,
    ),
}


def look_at(
    eye: tuple[float, float, float],
    target: tuple[float, float, float],
    fov_degrees: float,
    size: tuple[int, int] | None = None,
) -> Camera:
    """A fixed camera at `eye` that looks at `target`, upright."""
    z = np.subtract(target, eye) / np.linalg.norm(np.subtract(target, eye))
    x = np.cross(z, (0.0, 0.0, 1.0))
    x /= np.linalg.norm(x)
    R = np.stack([x, np.cross(z, x), z], axis=1)
    return Camera(se3.make(R, eye), float(np.radians(fov_degrees)), 10.0, size=size)


TWO_CAMERAS: dict[str, Camera] = {
    "left": look_at((0.45, 1.1, 1.6), (0.2, 0.0, 0.82), 40.0, (640, 480)),
    "right": look_at((0.45, -1.1, 1.6), (0.2, 0.0, 0.82), 40.0, (640, 480)),
}
"""As one puts two RealSense D415 beside a table, with the field of view of their depth images."""


def _colours(model: Any) -> FloatArray:
    """(geoms, 3) base colours: the geom's own, else its material's."""
    rgba = model.geom_rgba.astype(np.float64)
    has_material = model.geom_matid >= 0
    if np.any(has_material):
        inherits = has_material & np.all(np.isclose(rgba, UNSET_RGBA), axis=1)
        rgba[inherits] = model.mat_rgba[model.geom_matid[inherits]]
    colours: FloatArray = rgba[:, :3]
    return colours


@dataclass(frozen=True, eq=False)
class _Hits:
    """What the rays of one image met: depth (N,) with 0 for nothing, geom (N,), point and normal (N, 3)."""

    rays: FloatArray
    depth: FloatArray
    geom: IntArray
    point: FloatArray
    normal: FloatArray


def _cast(world: World, T: FloatArray, K: FloatArray, width: int, height: int, far: float) -> _Hits:
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    rays_camera = np.stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones(u.shape)], axis=-1)
    rays = rays_camera.reshape(-1, 3) @ T[:3, :3].T
    depth, geom = np.empty(len(rays)), np.empty(len(rays), dtype=np.int32)
    normal = np.zeros(rays.shape)
    # Rays of unit length along the optical axis make MuJoCo's distance the depth itself.
    hits = (geom, depth, normal.ravel())
    n, cutoff = len(rays), 4.0 * far
    mujoco.mj_multiRay(
        world.model, world.data, T[:3, 3], rays.ravel(), VISIBLE_GROUPS, True, -1, *hits, n, cutoff
    )
    nothing = (geom < 0) | (depth > far)
    depth[nothing], geom[nothing] = 0.0, -1
    return _Hits(rays, depth, geom, T[:3, 3] + depth[:, None] * rays, normal)


def _paint(world: World, hits: _Hits) -> FloatArray:
    """(N, 3) colours of the surfaces, pictures included, before any light falls on them."""
    rgb: FloatArray = _colours(world.model)[hits.geom]
    for geom in set(np.unique(hits.geom).tolist()) & world.pictures.keys():
        met = np.flatnonzero(hits.geom == geom)
        R = world.data.geom_xmat[geom].reshape(3, 3)
        points = (hits.point[met] - world.data.geom_xpos[geom]) @ R
        rgb[met] *= world.pictures[geom].colors(points, hits.normal[met] @ R)
    return rgb


def _shade(world: World, hits: _Hits) -> ByteArray:
    """(N, 3) uint8: Lambert's law with a light at the camera, one above, and some from everywhere."""
    view = -hits.rays / np.linalg.norm(hits.rays, axis=1, keepdims=True)
    facing = np.sum(view * hits.normal, axis=1)
    normal = hits.normal * np.where(facing < 0, -1.0, 1.0)[:, None]
    lamp = np.clip(normal @ LAMP_DIRECTION, 0.0, None)
    lamps = (
        np.outer(HEADLIGHT * np.abs(facing), world.light_color),
        np.outer(LAMP * lamp, world.light_color),
    )
    rgb = _paint(world, hits) * (AMBIENT + lamps[0] + lamps[1])
    rgb[hits.geom < 0] = BACKGROUND
    image: ByteArray = np.round(255 * np.clip(rgb, 0.0, 1.0)).astype(np.uint8)
    return image


def camera_view(world: World, camera: Camera, width: int, height: int) -> CameraView:
    """What one camera sees, with instance ids for training."""
    T, K = camera.T_world_camera(world), camera.intrinsics(width, height)
    hits = _cast(world, T, K, width, height, camera.far)
    bodies = world.model.geom_bodyid[hits.geom]
    ids = np.where(hits.geom < 0, 0, world.instances[bodies]).astype(np.int32)
    depth: Float32Array = hits.depth.astype(np.float32).reshape(height, width)
    rgb = _shade(world, hits).reshape(height, width, 3)
    return CameraView(rgb, depth, K, T, ids.reshape(height, width))


def render(world: World, size: int = 128, cameras: Mapping[str, Camera] = CAMERAS) -> dict[str, CameraView]:
    """What all cameras see, `size` x `size` pixels where a camera has no size of its own."""
    return {
        name: camera_view(world, camera, *(camera.size or (size, size))) for name, camera in cameras.items()
    }


def render_view(world: World, camera: str | Camera, width: int = 320, height: int = 240) -> ByteArray:
    """A picture (height, width, 3) uint8, for people.

    Raises:
        InvalidInput: if no camera has that name.
    """
    if isinstance(camera, str):
        if camera not in CAMERAS:
            raise InvalidInput("camera", camera, "one of " + ", ".join(CAMERAS))
        camera = CAMERAS[camera]
    T, K = camera.T_world_camera(world), camera.intrinsics(width, height)
    hits = _cast(world, T, K, width, height, camera.far)
    return _shade(world, hits).reshape(height, width, 3)


def observe(
    world: World, time_step: int = 0, size: int = 128, cameras: Mapping[str, Camera] = CAMERAS
) -> Observation:
    """What the robot sees (images as of `render`) and feels now, with instance ids for training."""
    return Observation(
        views=render(world, size, cameras),
        T_world_gripper=world.T_world_gripper,
        gripper_opening=world.gripper_opening,
        time_step=time_step,
        joint_positions=world.robot_q,
        joint_velocities=world.robot_dq,
        instance_names=world.instance_names,
    )
