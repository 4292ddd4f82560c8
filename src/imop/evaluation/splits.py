"""Which tasks of a suite are meant: by split, by name, or all."""

from imop.errors import AssetMissing, InvalidInput
from imop.tasks.rlbench.assets import COMMAND
from imop.tasks.suites import find_suite


def chosen_tasks(
    suite: str, split: str = "all", tasks: tuple[str, ...] = (), available: bool = True
) -> list[str]:
    """Full names of the tasks of a split, or of those of them that `tasks` names without the suite.

    Args:
        suite: which suite, see `find_suite`.
        split: which of its tasks.
        tasks: which of these; all if empty.
        available: leave out tasks whose files are missing, if they are not named.

    Raises:
        InvalidInput: for an unknown suite, split or task.
        AssetMissing: if no task would be left.
    """
    splits = find_suite(suite)
    if split not in splits:
        raise InvalidInput("split", split, ", ".join(splits))
    names = list(splits[split])
    known = [name.removeprefix(f"{suite}/") for name in names]
    if unknown := [task for task in tasks if task not in known]:
        raise InvalidInput("tasks", unknown[0], ", ".join(known))
    if tasks:
        return [f"{suite}/{task}" for task in tasks]
    present = [name for name in names if splits[split][name].available()]
    if available and not present:
        command = COMMAND if suite == "rlbench" else "what the suite's authors say"
        raise AssetMissing(f"the files of all {len(names)} tasks", command)
    return present if available else names
