"""How far counterparts may lie on other things of the kind.

A demonstration of each task is recorded and the learned matcher finds the region of its first step. Every
point of the region has the colour of its spread: small where other things of the kind are the same, seen from
the action.
"""

from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image

from imop.errors import InvalidInput
from imop.evaluation.picture import SPACING, draw_gripper, draw_points, project, scene_cloud
from imop.evaluation.splits import chosen_tasks
from imop.evaluation.trials import Trial, demonstration_for
from imop.extras import extra
from imop.files import replaced
from imop.geometry.perception import Perception
from imop.networks.model import BUNDLED, Model, load_model
from imop.policy.interfaces import PolicyConfig, Scene, Transition
from imop.policy.learned import find_shown_regions
from imop.policy.region import Region
from imop.robots.panda import panda_self_filter
from imop.types import Demonstration, Keyframe

with extra("viz"):
    from matplotlib.axes import Axes
    from matplotlib.collections import PathCollection
    from matplotlib.colors import LogNorm
    from matplotlib.figure import Figure

SMALLEST, LARGEST = 1.0, 50.0
"""Ends of the colour bar, millimetres."""
# How much of the scene's colours is left, so that those of the spread stand out.
FADED = 0.35
# Inches of a panel; metres from its middle to its edge, at least, and in parts of what has to be seen.
SIDE, CLOSEST, ROOM = 3.6, 0.1, 0.8


@dataclass(frozen=True)
class Options:
    """What is drawn.

    Attributes:
        out: the picture, a PNG.
        weights: of the networks.
        tasks: names of tabletop base tasks.
    """

    out: Path
    weights: Path = BUNDLED
    tasks: tuple[str, ...] = ("open_drawer", "close_jar", "cup_on_hook")


@dataclass(frozen=True, eq=False)
class Panel:
    """A part of the picture.

    Attributes:
        title: above it.
        step: the demonstrated state and action.
        region: of the step, with its spread.
    """

    title: str
    step: Keyframe
    region: Region


def first_region(model: Model, demonstration: Demonstration) -> Region:
    """The region of the first step, as the learned policy finds it."""
    perception = Perception(panda_self_filter().is_robot)
    seen = demonstration.stripped()
    observations = [*(keyframe.observation for keyframe in seen.keyframes), seen.final]
    scenes = [Scene(observation, perception.points(observation)) for observation in observations]
    steps = [
        Transition(before, after, keyframe.action)
        for before, after, keyframe in zip(scenes, scenes[1:], seen.keyframes, strict=False)
    ]
    return find_shown_regions(model, steps, PolicyConfig())[0].region


def save_spreads(panels: list[Panel], path: Path) -> None:
    """Draw the panels side by side and write a PNG.

    Raises:
        InvalidInput: if `path` does not end in .png.
    """
    if path.suffix != ".png":
        raise InvalidInput("out", str(path), "a file name that ends in .png")
    figure = Figure(figsize=(SIDE * len(panels) + 0.8, SIDE), layout="constrained", dpi=110)
    axes = figure.subplots(1, len(panels), squeeze=False)[0]
    for axis, panel in zip(axes, panels, strict=True):
        drawn = _draw(axis, panel)
    bar = figure.colorbar(drawn, ax=list(axes), label="spread, mm", extend="both")
    bar.set_ticks([1, 2, 5, 10, 20, 50], labels=["1", "2", "5", "10", "20", "50"])
    drawing = BytesIO()
    figure.savefig(drawing, format="png")
    with replaced(path) as temporary, Image.open(drawing) as image:
        # A palette makes the file a fifth as large; this one keeps rare colours, as those of the bar are.
        small = image.convert("RGB").quantize(method=Image.Quantize.MAXCOVERAGE)
        small.save(temporary, format="png", optimize=True)


def _draw(axis: Axes, panel: Panel) -> PathCollection:
    """The region in its surroundings and where the gripper goes; returns what the colour bar is for."""
    region, scene = panel.region, scene_cloud(panel.step.observation)
    T_goal, here = panel.step.action.T_world_gripper, np.zeros(2)
    shown = project(np.concatenate([region.cloud.points, T_goal[None, :3, 3]]))
    middle = (shown.min(axis=0) + shown.max(axis=0)) / 2
    half = max(CLOSEST, ROOM * float(np.ptp(shown, axis=0).max()))
    # As large as the gaps between points: the picture shows surfaces.
    size = (72 * SIDE * SPACING / (2 * half)) ** 2
    draw_points(axis, scene.points, 1 - FADED * (1 - scene.colors), here, size)
    drawn = draw_points(axis, region.cloud.points, 1000 * region.spreads, here, size)
    drawn.set(norm=LogNorm(SMALLEST, LARGEST), cmap="viridis")
    draw_gripper(axis, T_goal, here)
    axis.set(xlim=middle[0] + [-half, half], ylim=middle[1] + [-half, half], aspect="equal")
    axis.set_title(panel.title, fontsize=9)
    axis.set_axis_off()
    return drawn


def draw_spreads(options: Options) -> None:
    """Record demonstrations, find their regions, and draw them."""
    model = load_model(options.weights)
    panels = []
    for task in chosen_tasks("tabletop", "base", options.tasks):
        demonstration = demonstration_for(Trial(task, 0))
        title = task.removeprefix("tabletop/").replace("_", " ")
        region = first_region(model, demonstration)
        panels.append(Panel(title, demonstration.keyframes[0], region))
    save_spreads(panels, options.out)
