"""Suites and their splits, and tasks by name: imop's, those of installed packages, and one's own."""

import inspect
from collections.abc import Mapping
from difflib import get_close_matches
from typing import Any

from imop import plugins
from imop.errors import InvalidInput
from imop.tasks import rlbench, tabletop
from imop.tasks.task import Task

Suite = Mapping[str, Mapping[str, type[Task]]]
"""Split -> "suite/name" of a task -> the task.

The split "all" has every task but those that are made of others: "chain", "chain_novel" and "long".
"""

SUITES: dict[str, Suite] = {
    "tabletop": {
        "base": tabletop.BASE,
        "novel": tabletop.NOVEL,
        "cross_object": tabletop.CROSS_OBJECT,
        "real": tabletop.REAL,
        "chain": tabletop.CHAIN,
        "chain_novel": tabletop.CHAIN_NOVEL,
        "all": tabletop.TABLETOP,
    },
    "rlbench": {
        "base": rlbench.BASE,
        "novel": rlbench.NOVEL,
        "long": rlbench.LONG,
        "all": rlbench.RLBENCH,
    },
}

_SUITE = "a mapping split -> name -> imop.Task, named module:SUITE or by an entry point imop.suites"
_TASK = "a subclass of imop.Task, named module:Class or by an entry point imop.tasks"


def find_suite(name: str) -> Suite:
    """The suite of a name: one of `SUITES`, "module:SUITE", or an entry point of the group imop.suites.

    In one's own suite tasks have plain names, and the split "all" need not be there.

    Raises:
        InvalidInput: if there is none, or it is no suite.
    """
    suite = _known(name)
    if suite is None:
        raise InvalidInput("suite", name, f"{', '.join(SUITES)}, or {_SUITE}")
    return suite


def _known(name: str) -> Suite | None:
    if name in SUITES:
        return SUITES[name]
    found = plugins.find("suite", name, "imop.suites")
    return None if found is None else _suite(name, found)


def _suite(name: str, found: Any) -> Suite:
    splits = found.items() if isinstance(found, Mapping) else ()
    if not splits or not all(isinstance(tasks, Mapping) and tasks for _, tasks in splits):
        raise InvalidInput("suite", f"{name} is a {type(found).__name__}", _SUITE)
    names = [task for tasks in found.values() for task in tasks]
    if unfit := [task for task in names if not isinstance(task, str) or "/" in task]:
        raise InvalidInput("suite", f"{name} has a task {unfit[0]!r}", "names of tasks without a slash")
    suite = {
        split: {f"{name}/{task}": _task(f"{name}/{task}", kind) for task, kind in tasks.items()}
        for split, tasks in splits
    }
    return {**suite, "all": every_task(suite)}


def every_task(suite: Suite) -> dict[str, type[Task]]:
    """The tasks of all splits by their names."""
    return {name: kind for tasks in suite.values() for name, kind in tasks.items()}


def find_task(name: str) -> type[Task]:
    """The task of a name: "suite/name", "module:Class", or an entry point of the group imop.tasks.

    Raises:
        InvalidInput: if there is none, or it is no task.
    """
    suite = _known(name.rpartition("/")[0])
    tasks = {} if suite is None else every_task(suite)
    if name in tasks:
        return tasks[name]
    found = None if tasks and ":" in name else plugins.find("task", name, "imop.tasks")
    if found is None:
        raise InvalidInput("task", name, f"{_nearest(name, tasks)}, or {_TASK}")
    return _task(name, found)


def _nearest(name: str, tasks: Mapping[str, type[Task]]) -> str:
    known = [*tasks] or [task for suite in SUITES.values() for task in every_task(suite)]
    near = get_close_matches(name, known, n=3, cutoff=0.4) or known[:1]
    return f"a task such as {', '.join(near)} (`imop tasks --suite` lists those of {', '.join(SUITES)})"


def _task(name: str, found: Any) -> type[Task]:
    if not (isinstance(found, type) and issubclass(found, Task)):
        raise InvalidInput("task", f"{name} is {found!r}", _TASK)
    if inspect.isabstract(found):
        missing = ", ".join(sorted(found.__abstractmethods__))
        raise InvalidInput("task", f"{name} does not define {missing}", _TASK)
    if not plugins.takes_nothing(found):
        raise InvalidInput("task", f"{name} needs arguments", f"{_TASK}, made without any")
    return found
