"""The embedded suite: procedural tasks on a table."""

from imop.tasks.tabletop.lid_off_pot import LidOffPot
from imop.tasks.tabletop.open_drawer import OpenDrawer
from imop.tasks.tabletop.rubbish_in_bin import RubbishInBin
from imop.tasks.tabletop.stack_cubes import StackCubes
from imop.tasks.task import Task

TABLETOP: dict[str, type[Task]] = {
    "tabletop/open_drawer": OpenDrawer,
    "tabletop/stack_cubes": StackCubes,
    "tabletop/lid_off_pot": LidOffPot,
    "tabletop/rubbish_in_bin": RubbishInBin,
}
