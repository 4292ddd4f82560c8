"""A robot arm learns a manipulation task from one demonstration, without retraining.

Exit codes: 0 done, 1 the task failed or the data have errors, 2 bad input.
"""

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Literal

import tyro
from rich.console import Console
from tyro.conf import Positional

from imop.errors import ImopError
from imop.training.ablation import Ablation
from imop.training.config import TrainConfig

# Verbs import what they need when they run, so that --help does not wait for torch and MuJoCo.

app = tyro.extras.SubcommandApp()
console = Console()


@app.command
def run(
    task: str,
    seed: int = 1,
    variation: int = 0,
    instance: int = 0,
    demo: Path | None = None,
    method: Literal["learned", "routed", "replay", "registration", "oracle"] = "learned",
    weights: Path | None = None,
    min_confidence: float = 0.0,
    video: bool = True,
    out: Path = Path("runs/run"),
) -> int:
    """Show the policy one demonstration of a task, then let it perform the task in another scene.

    Writes result.json, steps.png (demonstration, region, correspondences, predicted gripper) and rollout.mp4.

    Args:
        task: suite and name, such as tabletop/lid_off_pot; `imop tasks` lists them.
        seed: scene to perform the task in.
        variation: which variation of the task.
        instance: seed of the objects' shapes, sizes and colours.
        demo: folder with a recorded demonstration, its first episode; records one if not given.
        method: how poses are carried over from the demonstration.
        weights: folder that `imop train` wrote; by default the bundled weights.
        min_confidence: stop instead of acting below this confidence, 0 to 1.
        video: whether to draw rollout.mp4, which takes longer than the task itself.
        out: folder for the results.
    """
    from imop.demos.load import load_demonstrations
    from imop.evaluation.run import perform, steps_table
    from imop.evaluation.trials import Trial, demonstration_for

    trial = Trial(task, seed, variation, instance)
    with console.status(f"recording one demonstration of {task}" if demo is None else f"reading {demo}"):
        shown = demonstration_for(trial) if demo is None else load_demonstrations(demo, 1)[0]
    with console.status(f"performing {task} in scene {seed}"):
        result = perform(trial, shown, method, out, min_confidence, video, weights)
    console.print(steps_table(result))
    verdict = "[green]success[/]" if result.success else f"[red]failed[/]: {result.reason}"
    console.print(f"{task}, scene {seed}: {verdict}")
    for path in sorted(out.iterdir()):
        console.print(f"  {path}", highlight=False)
    return 0 if result.success else 1


@app.command
def collect(
    out: Path,
    suite: str = "tabletop",
    split: Literal["base", "novel", "cross_object", "all"] = "all",
    tasks: tuple[str, ...] = (),
    episodes: int = 10,
    seed: int = 0,
    jobs: int = 2,
    cluster: str | None = None,
    scenes: int = 1,
    in_turn: bool = False,
) -> int:
    """Record demonstrations by the expert into a store, every task and variation.

    Episodes that are in the store already are not recorded again, so a run that was stopped is continued by
    starting it again. Neither that nor the number of processes changes what the store will contain. Writes a
    report beside the store.

    Args:
        out: folder of the store; an existing one is continued.
        suite: which suite.
        split: which of its tasks.
        tasks: names within the split; all if none is given.
        episodes: demonstrations per task and variation, each in its own scene.
        seed: number of the first episode; other numbers give other objects and scenes.
        jobs: parallel processes on this machine.
        cluster: address of a Ray cluster to work on instead, such as auto or 10.0.0.1:6379.
        scenes: how many demonstrations in a row have the same objects; regions are found with two or more.
        in_turn: count episodes per task, not per variation; sets of objects have the variations in turn.
    """
    from imop.evaluation.collect import collect as collect_into
    from imop.evaluation.splits import chosen_tasks

    names = chosen_tasks(suite, split, tasks)
    done = collect_into(out, names, episodes, seed, jobs, console, cluster, scenes, in_turn)
    total, failed = sum(done.episodes.values()), sum(done.failed_attempts.values())
    console.print(f"{total} demonstrations in {out}, {done.recorded} of them new in {done.seconds:.0f} s")
    console.print(f"{failed} expert attempts failed and were repeated with another seed")
    for what in done.given_up:
        console.print(f"[red]given up[/]: {what}")
    return 1 if done.given_up else 0


@app.command(name="eval")
def evaluate(
    suite: str = "tabletop",
    split: str = "all",
    tasks: tuple[str, ...] = (),
    methods: Annotated[str, tyro.conf.arg(metavar="NAME,NAME")] = "replay,registration,learned,oracle,expert",
    episodes: int = 25,
    seed: int = 0,
    instance: int = 0,
    jobs: int = 2,
    weights: Path | None = None,
    out: Path = Path("runs/eval"),
) -> int:
    """Success rates of several methods on the same demonstrations and scenes.

    Prints the table and writes results.json and report.md. Every episode is kept in episodes.jsonl, with the
    reason why it ended: run again, the same command goes on where it was stopped, and what was tried with
    the same code and weights is not tried again.

    Args:
        suite: which suite.
        split: base, novel, cross_object or all.
        tasks: names within the split; all if none is given.
        methods: any of replay, textbook (FPFH, RANSAC and ICP of Open3D, extra baselines), registration,
            learned, routed (learned, and the routing network may go back to a step), oracle (true object
            poses), expert, joined by commas.
        episodes: scenes per task, spread over its variations.
        seed: first seed of the scenes.
        instance: seed of the objects' shapes, sizes and colours.
        jobs: parallel processes.
        weights: folder that `imop train` wrote, for the learned policy; by default the bundled weights.
        out: folder for the results.
    """
    from imop.evaluation.benchmark import evaluate_suite

    log = out / "episodes.jsonl"
    results = evaluate_suite(
        suite, split, tasks, methods.split(","), episodes, seed, instance, jobs, console, log, weights
    )
    results.save(out)
    console.print(results.table())
    console.print(f"{out / 'report.md'}\n{out / 'results.json'}", highlight=False)
    return 0


@app.command(name="import")
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
    from rich.progress import track

    from imop.demos.rlbench_import import import_rlbench
    from imop.sim.robot import tip_pose

    done = import_rlbench(
        source,
        out,
        None if cameras is None else cameras.split(","),
        tip_pose,
        lambda these: track(these, f"importing {source}", transient=True),
    )
    for finding in done.findings:
        console.print(str(finding), highlight=False)
    console.print(
        f"{done.stored} demonstrations imported into {out}, {done.there_already} were there already"
    )
    return 1 if any(finding.severity == "error" for finding in done.findings) else 0


@app.command
def export(layout: Positional[Literal["rlbench"]], store: Positional[Path], out: Positional[Path]) -> int:
    """Write a store in the layout of other programs.

    Args:
        layout: how it is laid out: rlbench as PerAct, RVT and Act3D read it.
        store: the store.
        out: a new folder, which gets one folder per task.
    """
    from rich.progress import track

    from imop.demos.export import export_rlbench
    from imop.demos.store import DemonstrationStore

    def shown(numbers: range) -> Iterable[int]:
        return track(numbers, f"exporting {store}", console=console, transient=True)

    count = export_rlbench(DemonstrationStore.open(store), out, shown)
    console.print(f"{count} demonstrations exported into {out}")
    return 0


@app.command
def check(
    path: Positional[Path], cameras: Annotated[str | None, tyro.conf.arg(metavar="NAME,NAME")] = None
) -> int:
    """Say what is wrong with recorded demonstrations, where, and how to mend it.

    Args:
        path: a store, or a folder in RLBench's layout.
        cameras: which cameras every episode of the folder should have, joined by commas; by default front,
            left_shoulder, right_shoulder and wrist, as far as any episode has them.
    """
    from rich.progress import track

    from imop.demos.check import check as find
    from imop.sim.robot import tip_pose

    findings = find(
        path,
        None if cameras is None else cameras.split(","),
        tip_pose,
        lambda these: track(these, f"checking {path}", transient=True),
    )
    for finding in findings:
        console.print(str(finding), highlight=False)
    errors = sum(finding.severity == "error" for finding in findings)
    console.print(f"{path}: {errors} errors, {len(findings) - errors} warnings")
    return 1 if errors else 0


@app.command
def predict(
    demo: Path,
    query: Path,
    method: Literal["learned", "replay", "registration"] = "learned",
    weights: Path | None = None,
    out: Path = Path("runs/predict"),
) -> int:
    """Predict the action at every keyframe of a recorded episode from one demonstration; nothing moves.

    Writes result.json and steps.png.

    Args:
        demo: the demonstration: a store or an RLBench episode, its first episode.
        query: the recorded episode to predict, likewise.
        method: how poses are carried over from the demonstration.
        weights: folder that `imop train` wrote; by default the bundled weights.
        out: folder for the results.
    """
    from imop.demos.load import load_demonstrations
    from imop.evaluation.run import predict_recorded, predictions_table

    shown, recorded = (load_demonstrations(path, 1)[0] for path in (demo, query))
    with console.status(f"predicting {query}"):
        predictions = predict_recorded(shown, recorded, method, out, weights)
    console.print(predictions_table(predictions))
    for path in sorted(out.iterdir()):
        console.print(f"  {path}", highlight=False)
    return 0


@app.command
def tasks(
    suite: str = "tabletop",
    split: Literal["base", "novel", "cross_object", "all"] = "all",
    contact_sheet: Path | None = None,
    jobs: int = 2,
) -> int:
    """List tasks with their split, variations and instructions; draw them if wanted.

    Args:
        suite: which suite.
        split: which of its tasks.
        contact_sheet: PNG file to draw every task in four scenes into.
        jobs: parallel processes for the drawing.
    """
    from imop.evaluation.contact_sheet import save_contact_sheet, tasks_table
    from imop.evaluation.splits import chosen_tasks

    console.print(tasks_table(chosen_tasks(suite, split, available=False), suite))
    if contact_sheet is not None:
        save_contact_sheet(chosen_tasks(suite, split), contact_sheet, jobs, console)
        console.print(contact_sheet, highlight=False)
    return 0


@app.command
def assets(suite: Positional[Literal["rlbench"]], source: Annotated[Path, tyro.conf.arg(name="from")]) -> int:
    """Provide the model files that tasks need: they are copied into the user's cache, never into a package.

    Args:
        suite: whose files.
        source: a checkout of RLBench, or any folder with its .ttm files.
    """
    from imop.tasks.rlbench import RLBENCH
    from imop.tasks.rlbench.assets import folder, install

    files = [name.removeprefix(f"{suite}/") for name in RLBENCH]
    with console.status(f"reading {source}"):
        problems = install(source, files)
    for file, problem in problems.items():
        if problem:
            console.print(f"[red]{file}.ttm[/]: {problem}", highlight=False)
    missing = [file for file in files if file not in problems]
    if missing:
        console.print(f"not found: {', '.join(missing)}", highlight=False)
    ready = sum(task.available() for task in RLBENCH.values())
    console.print(f"{ready} of {len(files)} tasks of {suite} are available, from {folder()}", highlight=False)
    return 1 if any(problems.values()) else 0


@app.command
def train(
    config: Annotated[TrainConfig, tyro.conf.OmitArgPrefixes],
    ablation: Annotated[Ablation, tyro.conf.OmitArgPrefixes],
    size: Literal["small", "paper"] = "small",
) -> int:
    """Train networks on shards; run again with the same arguments, it continues where it was stopped.

    Shards are written by `python -m imop.training.generate` and its neighbours, see docs/training.md. Under
    torchrun it trains on several processes or machines.

    Args:
        config: how to train.
        ablation: what is left out of the networks or exchanged.
        size: of the networks.
    """
    from imop.networks.model import PAPER, SMALL
    from imop.training.loop import train as run_training

    run_training(config, ablation.of(SMALL if size == "small" else PAPER), console=console)
    console.print(config.out, highlight=False)
    return 0


@app.command
def model(config: Literal["small", "paper"] = "small", weights: Path | None = None) -> int:
    """Say how many parameters each network has.

    Args:
        config: which size.
        weights: folder of trained weights to describe instead.
    """
    import torch

    from imop.evaluation.model_table import model_table
    from imop.networks.model import PAPER, SMALL, Model, load_model

    if weights is not None:
        console.print(model_table(load_model(weights), str(weights)))
        return 0
    with torch.device("meta"):
        console.print(model_table(Model(SMALL if config == "small" else PAPER), config))
    return 0


def main(arguments: list[str] | None = None) -> None:
    """Entry point of `imop`."""
    try:
        code = app.cli(prog="imop", description=__doc__, args=arguments)
    except ImopError as error:
        Console(stderr=True, soft_wrap=True).print(f"[red]error:[/] {error}", highlight=False)
        code = 2
    except KeyboardInterrupt:
        code = 130
    sys.exit(code)
