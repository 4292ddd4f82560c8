"""One picture of what the policy did: demonstration, region, correspondences and predicted gripper."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from imop.extras import extra
from imop.files import replaced
from imop.geometry import cloud as clouds
from imop.geometry import se3
from imop.geometry.cloud import PointCloud
from imop.geometry.perception import WORKSPACE_LOWER, WORKSPACE_UPPER
from imop.types import Action, FloatArray, Keyframe, Observation

with extra("viz"):
    import matplotlib
    from matplotlib.axes import Axes
    from matplotlib.collections import LineCollection, PathCollection
    from matplotlib.figure import Figure

REGION_COLOR = "#12a150"
MATCH_COLOR = "#d62728"
GRIPPER_COLOR = "#1f3fbf"
MAX_LINES = 60
# Metres between the points of a scene as drawn.
SPACING = 0.006
Bounds = tuple[tuple[float, float, float], tuple[float, float, float]]
"""Lower and upper corner of what is drawn, metres."""
# Distance (metres) between the two scenes as drawn.
GAP = 1.3


def _looking_from(direction: tuple[float, float, float]) -> FloatArray:
    """Rows: the right, up and towards-the-viewer axes (3, 3) of an orthographic view, in the world."""
    towards = np.asarray(direction) / np.linalg.norm(direction)
    right = np.cross((0.0, 0.0, 1.0), towards)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(towards, right), towards])


VIEW = _looking_from((1.0, 0.5, 0.9))

# A two-fingered gripper as line segments in the gripper frame, metres.
GRIPPER = np.array(
    [
        [[0, -0.04, 0.0], [0, -0.04, -0.05]],
        [[0, 0.04, 0.0], [0, 0.04, -0.05]],
        [[0, -0.04, -0.05], [0, 0.04, -0.05]],
        [[0, 0.0, -0.05], [0, 0.0, -0.11]],
    ]
)


@dataclass(frozen=True)
class Panel:
    """One row of the picture: the demonstrated step and the scene it was carried over to."""

    support: Keyframe
    query: Observation
    action: Action
    title: str = ""
    bounds: Bounds = (WORKSPACE_LOWER, WORKSPACE_UPPER)


def save_picture(panels: Sequence[Panel], path: Path) -> None:
    """Draw one row per predicted action and write a PNG."""
    matplotlib.use("Agg", force=False)
    figure = Figure(figsize=(9.0, 3.6 * len(panels)), layout="constrained")
    axes = figure.subplots(len(panels), 1, squeeze=False)[:, 0]
    for axis, panel in zip(axes, panels, strict=True):
        _draw(axis, panel)
    with replaced(path) as temporary:
        figure.savefig(temporary, dpi=110, format="png")


def _draw(axis: Axes, panel: Panel) -> None:
    right = np.array([GAP, 0.0])
    for observation, shift in ((panel.support.observation, np.zeros(2)), (panel.query, right)):
        cloud = scene_cloud(observation, panel.bounds)
        draw_points(axis, cloud.points, cloud.colors, shift)
    match = panel.action.match
    if match is not None:
        if len(match.region):
            region = project(match.region)
            axis.scatter(region[:, 0], region[:, 1], s=2.0, color=REGION_COLOR, linewidths=0)
        chosen = np.linspace(0, len(match.p_support) - 1, min(MAX_LINES, len(match.p_support))).astype(int)
        ends = np.stack([project(match.p_support[chosen]), project(match.p_query[chosen]) + right], axis=1)
        axis.add_collection(LineCollection(list(ends), colors=MATCH_COLOR, linewidths=0.5, alpha=0.7))
    draw_gripper(axis, panel.support.action.T_world_gripper, np.zeros(2))
    draw_gripper(axis, panel.action.T_world_gripper, right)
    axis.set_title(
        f"{panel.title}    left: demonstration and region, right: new scene and predicted gripper", fontsize=8
    )
    axis.set_aspect("equal")
    axis.set_axis_off()


def scene_cloud(observation: Observation, bounds: Bounds = (WORKSPACE_LOWER, WORKSPACE_UPPER)) -> PointCloud:
    """What is seen of the workspace, thinned for a picture."""
    cloud = clouds.crop(clouds.fuse(observation), *bounds)
    return clouds.voxel_downsample(cloud, SPACING)


def draw_points(
    axis: Axes, points: FloatArray, colors: NDArray[np.floating], shift: FloatArray, size: float = 1.6
) -> PathCollection:
    """Draw points (N, 3) of the world in colours (N, 3), or in values (N,) of a colour map; near ones on top.

    Args:
        axis: where.
        points: metres.
        colors: red, green and blue of 0 .. 1, or any numbers.
        shift: (2,) metres that the scene is moved by in the picture.
        size: area of a point as drawn, square points of typography.
    """
    far_to_near = np.argsort(points @ VIEW[2])
    positions = project(points)[far_to_near] + shift
    return axis.scatter(positions[:, 0], positions[:, 1], s=size, c=colors[far_to_near], linewidths=0)


def draw_gripper(axis: Axes, T_world_gripper: FloatArray, shift: FloatArray) -> None:
    """Draw a gripper at T_world_gripper (4, 4), moved by `shift` (2,) metres in the picture."""
    segments = project(se3.apply(T_world_gripper, GRIPPER.reshape(-1, 3))).reshape(-1, 2, 2) + shift
    axis.add_collection(LineCollection(list(segments), colors="white", linewidths=4.0))
    axis.add_collection(LineCollection(list(segments), colors=GRIPPER_COLOR, linewidths=2.0))


def project(p_world: FloatArray) -> FloatArray:
    """(N, 3) world points -> (N, 2) positions in the picture, metres."""
    return np.asarray(p_world @ VIEW[:2].T)
