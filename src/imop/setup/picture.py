"""A picture of what the self-filter left of the robot."""

from pathlib import Path

import numpy as np

from imop.errors import InvalidInput
from imop.extras import extra
from imop.files import replaced
from imop.geometry.cloud import crop, fuse
from imop.setup.arm import SetupArm
from imop.setup.setup import Setup
from imop.types import Observation

with extra("viz"):
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

_POINTS = 40_000
_SIDES = (("from above", 0, 1), ("from the side", 0, 2), ("from the front", 1, 2))


def draw_filtered(setup: Setup, arm: SetupArm, seen: Observation, path: Path) -> None:
    """Draw the workspace from three sides: what stays in its colours, what the filter removed in red.

    Args:
        setup: of the cell.
        arm: of the set-up.
        seen: an observation of it, with joint positions.
        path: PNG file to write.

    Raises:
        InvalidInput: if the observation has no joint positions, or no measured depth.
    """
    cloud = crop(fuse(seen), setup.workspace.lower, setup.workspace.upper)
    if seen.joint_positions is None:
        raise InvalidInput("joint_positions", "missing, but the self-filter needs them", "radians")
    robot = arm.self_filter.is_robot(cloud.points, seen.joint_positions, seen.gripper_opening)
    rows = np.random.default_rng(0).permutation(len(cloud))[:_POINTS]
    points, colors = cloud.points[rows], np.where(robot[rows, None], (0.9, 0.1, 0.1), cloud.colors[rows])
    figure = Figure(figsize=(15, 5), layout="constrained")
    FigureCanvasAgg(figure)
    for axes, (title, i, j) in zip(figure.subplots(1, 3), _SIDES, strict=True):
        order = np.argsort(points[:, 3 - i - j])
        axes.scatter(points[order, i], points[order, j], s=1, c=colors[order], linewidths=0)
        tip, base = seen.T_world_gripper[:3, 3], setup.robot.T_world_base[:3, 3]
        axes.plot(tip[i], tip[j], "b+", markersize=14, label="gripper")
        axes.plot(base[i], base[j], "kx", markersize=10, label="base")
        if j == 2:
            axes.axhline(setup.workspace.table_height, color="green", linewidth=0.8, label="table")
        axes.set(title=title, xlabel="xyz"[i] + " / m", ylabel="xyz"[j] + " / m", aspect="equal")
    axes.legend()
    figure.suptitle(f"{robot.sum()} of {len(robot)} points are the robot's (red) and are removed")
    with replaced(path) as temporary:
        figure.savefig(temporary, format="png", dpi=80)
