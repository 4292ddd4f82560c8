"""Commands about files: recorded demonstrations, and the model files of tasks."""

from pathlib import Path
from typing import Annotated, Literal

import tyro
from tyro.conf import Positional

from imop.terminal import console, status, track


def import_(
    layout: Positional[Literal["rlbench"]],
    source: Positional[Path],
    out: Positional[Path],
    cameras: Annotated[str | None, tyro.conf.arg(metavar="NAME,NAME")] = None,
) -> int:
    """Convert recorded demonstrations into a store.

    Nothing that can be read is left out; what `imop check` would say about it is said. Episodes that are in
    the store already are not stored again, so an import that was stopped is continued by starting it again.

    Args:
        layout: how the recordings are laid out: rlbench as PerAct, RVT and Act3D use it.
        source: an episode, a task folder, or a folder of task folders.
        out: folder of the store; an existing one is appended to.
        cameras: which cameras, joined by commas; by default front, left_shoulder, right_shoulder and wrist,
            as far as they were recorded.
    """
    from imop.demos.rlbench_import import import_rlbench
    from imop.robots.panda import tip_pose

    names = None if cameras is None else cameras.split(",")
    done = import_rlbench(source, out, names, tip_pose, lambda these: track(these, f"importing {source}"))
    for finding in done.findings:
        console.print(str(finding))
    console.print(
        f"{done.stored} demonstrations imported into {out}, {done.there_already} were there already"
    )
    return 1 if any(finding.severity == "error" for finding in done.findings) else 0


def export(layout: Positional[Literal["rlbench"]], store: Positional[Path], out: Positional[Path]) -> int:
    """Write a store in the layout of other programs.

    Args:
        layout: how it is laid out: rlbench as PerAct, RVT and Act3D read it.
        store: the store.
        out: a new folder, which gets one folder per task.
    """
    from imop.demos.export import export_rlbench
    from imop.demos.store import DemonstrationStore

    stored = DemonstrationStore.open(store)
    count = export_rlbench(stored, out, lambda numbers: track(numbers, f"exporting {store}"))
    console.print(f"{count} demonstrations exported into {out}")
    return 0


def check(
    path: Positional[Path], cameras: Annotated[str | None, tyro.conf.arg(metavar="NAME,NAME")] = None
) -> int:
    """Say what is wrong with recorded demonstrations, where, and how to mend it.

    Args:
        path: a store, or a folder in RLBench's layout.
        cameras: which cameras every episode of the folder should have, joined by commas; by default front,
            left_shoulder, right_shoulder and wrist, as far as any episode has them.
    """
    from imop.demos.check import check as find
    from imop.robots.panda import tip_pose

    names = None if cameras is None else cameras.split(",")
    findings = find(path, names, tip_pose, lambda these: track(these, f"checking {path}"))
    for finding in findings:
        console.print(str(finding))
    errors = sum(finding.severity == "error" for finding in findings)
    console.print(f"{path}: {errors} errors, {len(findings) - errors} warnings")
    return 1 if errors else 0


def assets(suite: Positional[Literal["rlbench"]], source: Annotated[Path, tyro.conf.arg(name="from")]) -> int:
    """Provide the model files that tasks need: they are copied into the user's cache, never into a package.

    Args:
        suite: whose files.
        source: a checkout of RLBench, or any folder with its .ttm files.
    """
    from imop.tasks.rlbench import RLBENCH
    from imop.tasks.rlbench.assets import folder, install

    files = [name.removeprefix(f"{suite}/") for name in RLBENCH]
    with status(f"reading {source}"):
        done = install(source, files)
    unreadable = {file: found.error for file, found in done.items() if found.error}
    for file, problem in unreadable.items():
        console.print(f"{file}.ttm: {problem}", style="red")
    missing = [file for file in files if file not in done]
    if missing:
        console.print(f"not found: {', '.join(missing)}")
    for file, found in done.items():
        if file not in files and not found.error:
            remarks = "; ".join(found.lacks) or "nothing is lacking"
            console.print(f"{file}.ttm, for a task of your own: {remarks}")
    ready = sum(task.available() for task in RLBENCH.values())
    console.print(f"{ready} of {len(files)} tasks of {suite} are available, from {folder()}")
    return 1 if unreadable else 0
