"""What the tasks look like: one picture with a row of scenes for every task, and a table of them in words."""

import textwrap
from pathlib import Path

from joblib import delayed
from rich.console import Console
from rich.table import Table
from rich.text import Text

from imop.errors import InvalidInput
from imop.evaluation.jobs import parallel
from imop.extras import extra
from imop.files import replaced
from imop.sim.cameras import look_at, render_view
from imop.tasks.env import make_task
from imop.tasks.suites import find_suite
from imop.tasks.task import make_scene
from imop.types import ByteArray

SCENES = 4
SHOWN = look_at((-0.42, -0.85, 1.72), (0.2, 0.03, 0.84), 44.0)
"""From beside the arm, because what opens does so towards it."""
_WIDTH, _HEIGHT = 360, 270
_LISTED = 4


def save_contact_sheet(tasks: list[str], path: Path, jobs: int, console: Console) -> None:
    """Draw every task in `SCENES` scenes with their own objects, its variations in turn, and write a PNG.

    Raises:
        InvalidInput: for an unknown task, or if `path` does not end in .png.
        NoRoom: if a scene could not be laid out.
        MissingExtra: without Matplotlib.
    """
    with extra("viz"):
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    if path.suffix != ".png":
        raise InvalidInput("contact-sheet", str(path), "a file name that ends in .png")
    scenes = [(task, _variation(task, column), column) for task in tasks for column in range(SCENES)]
    pictures = list(parallel([delayed(picture)(*scene) for scene in scenes], jobs, console, "scenes"))
    figure = Figure(figsize=(3.6 * SCENES, 3.15 * len(tasks)), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(tasks), SCENES, squeeze=False)
    for axis, (task, variation, _), image in zip(axes.flat, scenes, pictures, strict=True):
        axis.imshow(image)
        axis.set_axis_off()
        words = textwrap.fill(make_task(task).instructions(variation)[0], 48)
        axis.set_title(f"{task.split('/')[-1]}, variation {variation}\n{words}", fontsize=8, loc="left")
    with replaced(path) as temporary:
        figure.savefig(temporary, dpi=100, format="png")


def picture(task: str, variation: int, seed: int) -> ByteArray:
    """(height, width, 3) uint8 of one untouched scene."""
    world = make_scene(make_task(task), variation, seed, seed)
    return render_view(world, SHOWN, _WIDTH, _HEIGHT)


def _variation(task: str, column: int) -> int:
    """Variations spread over the columns."""
    return column * max(1, make_task(task).variations // SCENES) % make_task(task).variations


def tasks_table(tasks: list[str], suite: str) -> Table:
    """Split, number of variations, and the instructions of the first variations."""
    splits = find_suite(suite)
    split_of = {name: split for split in sorted(splits, key="all".__ne__) for name in splits[split]}
    table = Table(show_lines=True)
    table.add_column("task", no_wrap=True)
    table.add_column("instructions")
    for name in tasks:
        task = make_task(name)
        shown = [task.instructions(variation)[0] for variation in range(min(task.variations, _LISTED))]
        if task.variations > _LISTED:
            shown.append("...")
        counted = f"{task.variations} variation{'s' if task.variations > 1 else ''}"
        there = "" if task.available() else "\nfile missing"
        row = Text.assemble(f"{name}\n{split_of[name]}, {counted}", (there, "red"))
        table.add_row(row, Text("\n".join(shown)))
    return table
