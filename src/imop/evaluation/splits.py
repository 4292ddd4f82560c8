"""Which tasks of a suite are meant: by split, by name, or all."""

from imop.errors import InvalidInput
from imop.tasks import rlbench
from imop.tasks.tabletop import BASE, CROSS_OBJECT, NOVEL, TABLETOP
from imop.tasks.task import Task

SPLITS: dict[str, dict[str, dict[str, type[Task]]]] = {
    "tabletop": {"base": BASE, "novel": NOVEL, "cross_object": CROSS_OBJECT, "all": TABLETOP},
    "rlbench": {"base": rlbench.BASE, "novel": rlbench.NOVEL, "all": rlbench.RLBENCH},
}
"""Suite -> split -> task by its full name."""


def chosen_tasks(suite: str, split: str = "all", tasks: tuple[str, ...] = ()) -> list[str]:
    """Full names of the tasks of a split, or of those of them that `tasks` names without the suite.

    Raises:
        InvalidInput: for an unknown suite, split or task.
    """
    if suite not in SPLITS:
        raise InvalidInput("suite", suite, ", ".join(SPLITS))
    if split not in SPLITS[suite]:
        raise InvalidInput("split", split, ", ".join(SPLITS[suite]))
    names = list(SPLITS[suite][split])
    known = [name.removeprefix(f"{suite}/") for name in names]
    if unknown := [task for task in tasks if task not in known]:
        raise InvalidInput("tasks", unknown[0], ", ".join(known))
    return [f"{suite}/{task}" for task in tasks] or names
