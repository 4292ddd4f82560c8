"""Which tasks of a suite are meant: by split, by name, or all."""

from imop.errors import AssetMissing, InvalidInput
from imop.tasks import rlbench
from imop.tasks.rlbench.assets import COMMAND
from imop.tasks.tabletop import BASE, CROSS_OBJECT, NOVEL, TABLETOP
from imop.tasks.task import Task

SPLITS: dict[str, dict[str, dict[str, type[Task]]]] = {
    "tabletop": {"base": BASE, "novel": NOVEL, "cross_object": CROSS_OBJECT, "all": TABLETOP},
    "rlbench": {"base": rlbench.BASE, "novel": rlbench.NOVEL, "all": rlbench.RLBENCH},
}
"""Suite -> split -> task by its full name."""


def chosen_tasks(
    suite: str, split: str = "all", tasks: tuple[str, ...] = (), available: bool = True
) -> list[str]:
    """Full names of the tasks of a split, or of those of them that `tasks` names without the suite.

    Args:
        suite: which suite.
        split: which of its tasks.
        tasks: which of these; all if empty.
        available: leave out tasks whose files are missing, if they are not named.

    Raises:
        InvalidInput: for an unknown suite, split or task.
        AssetMissing: if no task would be left.
    """
    if suite not in SPLITS:
        raise InvalidInput("suite", suite, ", ".join(SPLITS))
    if split not in SPLITS[suite]:
        raise InvalidInput("split", split, ", ".join(SPLITS[suite]))
    names = list(SPLITS[suite][split])
    known = [name.removeprefix(f"{suite}/") for name in names]
    if unknown := [task for task in tasks if task not in known]:
        raise InvalidInput("tasks", unknown[0], ", ".join(known))
    if tasks:
        return [f"{suite}/{task}" for task in tasks]
    present = [name for name in names if SPLITS[suite][split][name].available()]
    if available and not present:
        raise AssetMissing(f"the files of all {len(names)} tasks", COMMAND)
    return present if available else names
