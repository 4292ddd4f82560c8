"""Commands about files: recorded demonstrations, what is predicted of them, and the model files of tasks."""

from pathlib import Path
from typing import Annotated, Literal

import tyro
from tyro.conf import Positional

from imop.errors import InvalidInput, MissingExtra
from imop.files import writable_folder
from imop.terminal import console, list_folder, status, track


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


def predict(
    demo: Path,
    query: Path,
    demo_episode: int = 0,
    query_episode: int = 0,
    base: tuple[float, float, float] | None = None,
    robot: str = "panda",
    method: str = "learned",
    weights: Path | None = None,
    out: Path = Path("runs/predict"),
) -> int:
    """Predict the action at every keyframe of a recorded episode from one demonstration; nothing moves.

    Writes result.json and, with the extra viz, steps.png. Without the extra sim, poses that the Panda cannot
    reach are not ruled out.

    Args:
        demo: store or folder of RLBench's layout with the demonstration.
        query: store or folder with the recorded episode to predict.
        demo_episode: number of the demonstration's episode.
        query_episode: number of the episode to predict.
        base: where the robot's base is in the recordings' frame, metres; by default as in the simulation,
            with a table at a height of 0.752 m.
        robot: whose points are left out and which poses are reached: panda, a set-up such as cell.toml, in
            whose world the recordings are, or one's own, such as my_robot:MyArm.
        method: learned, replay, registration, textbook, or one's own, such as my_methods:MyPolicy.
        weights: folder that `imop train` wrote; by default the bundled weights.
        out: folder for the results.
    """
    from imop.demos.frames import moved
    from imop.demos.load import load_demonstration
    from imop.evaluation.predict import draw_predictions, frame_of, predict_recorded, predictions_table

    writable_folder(out)
    if base is not None and robot.endswith((".toml", ".json")):
        raise InvalidInput("base", f"{base} together with {robot}", "one of the two; a set-up has the base")
    T_imop_world = frame_of(base)
    shown, recorded = load_demonstration(demo, demo_episode), load_demonstration(query, query_episode)
    shown, recorded = moved(shown, T_imop_world), moved(recorded, T_imop_world)
    with status(f"predicting {query}"):
        origin = {"demo": f"{demo}", "demo_episode": demo_episode, "query": f"{query}"}
        origin |= {"query_episode": query_episode, "base": base, "robot": robot}
        origin["weights"] = weights and f"{weights}"
        predictions = predict_recorded(shown, recorded, method, out, weights, T_imop_world, robot, origin)
        try:
            draw_predictions(shown, recorded, predictions, out / "steps.png", robot)
        except MissingExtra as error:
            console.print(f"no steps.png: {error}")
    console.print(predictions_table(predictions))
    list_folder(out)
    return 0
