"""Scenes made of boxes on a table, as clouds; no rendering."""

import numpy as np

from imop.geometry import se3
from imop.geometry.cloud import PointCloud, concatenate
from imop.policy.interfaces import Scene, Transition
from imop.types import Action, CameraView, Observation

DOWN = np.diag([1.0, -1.0, -1.0])
RED, GREEN, BLUE, GREY = (0.8, 0.1, 0.1), (0.1, 0.7, 0.1), (0.1, 0.1, 0.8), (0.5, 0.5, 0.5)
TABLE = 0.75


def box(size, color, T=None, spacing=0.004, seed=0):
    """Random points on the five visible faces of a box that stands on its frame's xy plane."""
    rng = np.random.default_rng(seed)
    parts = []
    for axis, side in ((0, -1), (0, 1), (1, -1), (1, 1), (2, 1)):
        others = [a for a in range(3) if a != axis]
        count = int(size[others[0]] * size[others[1]] / spacing**2)
        points = rng.uniform(-0.5, 0.5, (count, 3)) * size
        points[:, axis] = side * size[axis] / 2
        points[:, 2] += size[2] / 2
        parts.append(colored(points, np.tile(side * np.eye(3)[axis], (count, 1)), color))
    return moved(concatenate(parts), np.eye(4) if T is None else T)


def colored(points, normals, color):
    colors = np.tile(np.array(color, dtype=np.float32), (len(points), 1))
    return PointCloud(points, colors, np.zeros(len(points), dtype=np.int32), normals)


def moved(cloud, T):
    return PointCloud(
        se3.apply(T, cloud.points), cloud.colors, cloud.camera, se3.rotate(T, cloud.normals), cloud.ids
    )


def marked_can(mark_yaw, T):
    """A grey can with a dark strip on its top, along its x axis turned by `mark_yaw`."""
    rng = np.random.default_rng(0)
    angle = rng.uniform(0, 2 * np.pi, 3000)
    out = np.stack([np.cos(angle), np.sin(angle), np.zeros(3000)], axis=1)
    wall = 0.03 * out + rng.uniform(0, 0.05, (3000, 1)) * [0, 0, 1]
    top = out[:1500] * 0.03 * np.sqrt(rng.uniform(0, 1, (1500, 1))) + [0, 0, 0.05]
    strip = np.abs(top @ [-np.sin(mark_yaw), np.cos(mark_yaw), 0]) < 0.004
    parts = [colored(wall, out, GREY)]
    for those, color in ((~strip, GREY), (strip, (0.2, 0.2, 0.2))):
        parts.append(colored(top[those], np.tile([0.0, 0, 1], (those.sum(), 1)), color))
    return moved(concatenate(parts), T)


def table():
    grid = np.stack(np.meshgrid(np.arange(-0.2, 0.6, 0.01), np.arange(-0.4, 0.4, 0.01)), axis=-1)
    points = np.c_[grid.reshape(-1, 2), np.full(grid[..., 0].size, TABLE)]
    return colored(points, np.tile([0.0, 0, 1], (len(points), 1)), GREY)


def at(x, y, z=TABLE, yaw=0.0):
    return se3.make(se3.euler(z=yaw), (x, y, z))


def above(x, y, z):
    """T_world_gripper, pointing down."""
    return se3.make(DOWN, (x, y, z))


def camera(depth=None):
    """A view from 2 m above the origin, straight down; `depth` (64, 64), by default no measurements."""
    depth = np.zeros((64, 64), np.float32) if depth is None else depth
    K = np.array([[60.0, 0, 32], [0, 60, 32], [0, 0, 1]])
    return CameraView(np.zeros((64, 64, 3), np.uint8), depth, K, se3.make(DOWN, (0, 0, 2)))


def scene(clouds, T_world_gripper, opening=1.0):
    observation = Observation({"top": camera()}, T_world_gripper, opening)
    return Scene(observation, concatenate([table(), *clouds]))


def transitions(scenes, actions):
    """Steps of a demonstration from len(actions) + 1 scenes and (T, gripper_open) pairs."""
    return [
        Transition(before, after, Action(T, gripper_open))
        for before, after, (T, gripper_open) in zip(scenes, scenes[1:], actions, strict=False)
    ]
