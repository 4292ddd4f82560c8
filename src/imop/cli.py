"""A robot arm learns a manipulation task from one demonstration, without retraining.

Exit codes: 0 done, 1 the task failed or the data have errors, 2 bad input or a file that cannot be used.
"""

import os
import sys
from pathlib import Path
from typing import Annotated, Literal

import tyro
from rich.console import Console
from rich.text import Text
from tyro.conf import Positional

from imop import cli_data
from imop.calibration.command import calibrate
from imop.errors import ImopError, InvalidInput
from imop.files import writable_folder
from imop.reproduce.command import reproduce
from imop.serving.command import serve
from imop.setup.command import setup
from imop.terminal import console, list_folder, status
from imop.training.ablation import Ablation
from imop.training.config import TrainConfig
from imop.training.recipe import RecipeName, make, refuse_others
from imop.viewing.command import view

# Verbs import what they need when they run, so that --help does not wait for torch and MuJoCo.

app = tyro.extras.SubcommandApp()
Disturb = Literal["", "moved", "knocked", "missed", "shut"]


@app.command
def run(
    task: str,
    seed: int = 1,
    variation: int = 0,
    instance: int = 0,
    shown: int | None = None,
    demo: Path | None = None,
    demo_episode: int = 0,
    method: str = "learned",
    change: Annotated[str, tyro.conf.arg(metavar="FACTOR,FACTOR")] = "",
    disturb: Disturb = "",
    weights: Path | None = None,
    min_confidence: float = 0.0,
    video: bool = True,
    out: Path = Path("runs/run"),
) -> int:
    """Show the policy one demonstration of a task, then let it perform the task in another scene.

    Writes result.json, steps.png (demonstration, region, correspondences, predicted gripper) and rollout.mp4.
    Needs the extras sim and viz.

    Args:
        task: suite and name, such as tabletop/lid_off_pot (`imop tasks` lists them), or one's own, such as
            my_tasks:OpenFridge.
        seed: scene to perform the task in.
        variation: which variation of the task.
        instance: seed of the objects' shapes, sizes and colours.
        shown: that of the demonstrated objects, if it shall show others of their kind.
        demo: store or folder of RLBench's layout with a demonstration; one is recorded if not given.
        demo_episode: which of its episodes.
        method: learned, advancing, paper, replay, registration, textbook, oracle (true object poses), or
            one's own, such as my_methods:MyPolicy.
        change: what the scene differs in from the demonstrated one, as in `imop eval`.
        disturb: what goes wrong once, as in `imop eval`.
        weights: folder that `imop train` wrote; by default the bundled weights.
        min_confidence: stop instead of acting below this confidence, 0 to 1.
        video: whether to draw rollout.mp4, which takes longer than the task itself.
        out: folder for the results.
    """
    from imop.demos.load import load_demonstration
    from imop.evaluation.run import perform, steps_table
    from imop.evaluation.trials import Trial, demonstration_for, require_instances
    from imop.tasks.changes import changes_of
    from imop.tasks.suites import find_task

    writable_folder(out)
    factors = ",".join(changes_of({task: find_task(task)}, change)[task])
    trial = Trial(task, seed, variation, instance, factors, shown, disturb=disturb)
    if shown is not None:
        require_instances(task, "shown", f"{shown}", "nothing")
        if demo is not None:
            raise InvalidInput("shown", f"{shown} together with demo {demo}", "one of the two")
    with status(f"recording one demonstration of {task}" if demo is None else f"reading {demo}"):
        watched = demonstration_for(trial) if demo is None else load_demonstration(demo, demo_episode)
    with status(f"performing {task} in scene {seed}"):
        origin = {
            "demo": demo and f"{demo}",
            "demo_episode": demo_episode,
            "weights": weights and f"{weights}",
        }
        result = perform(trial, watched, method, out, min_confidence, video, weights, origin)
    console.print(steps_table(result))
    scene = f"scene {seed}" + (f", instance {instance} after {shown}" if trial.other_things else "")
    scene += f", changed: {factors}" if factors else ""
    console.print(
        f"{task}, {scene}: {'success' if result.success else f'failed: {result.reason}'}",
        style="green" if result.success else "red",
    )
    list_folder(out)
    return 0 if result.success else 1


@app.command
def collect(
    out: Path,
    suite: str = "tabletop",
    split: str = "all",
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
        suite: tabletop, rlbench, or one's own, such as my_suite:SUITE.
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
        console.print(f"given up: {what}", style="red")
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
    instances: Literal["same", "other"] = "same",
    change: Annotated[str, tyro.conf.arg(metavar="FACTOR,FACTOR")] = "",
    disturb: Disturb = "",
    second_try: bool = False,
    demonstrations: int = 1,
    jobs: int = 2,
    weights: Path | None = None,
    baselines: Path | None = None,
    robot: Literal["panda", "iiwa14", "ur5e"] = "panda",
    out: Path = Path("runs/eval"),
) -> int:
    """Success rates of several methods on the same demonstrations and scenes.

    Prints the table and writes results.json and report.md. Every episode is kept in episodes.jsonl, with the
    reason why it ended: run again, the same command goes on where it was stopped, and what was tried with
    the same code and weights is not tried again.

    Args:
        suite: tabletop, rlbench, or one's own, such as my_suite:SUITE.
        split: base, novel, cross_object, real, chain, chain_novel (tabletop), long (rlbench) or all.
        tasks: names within the split; all if none is given.
        methods: any of replay, textbook (FPFH, RANSAC and ICP of Open3D, extra baselines), registration,
            learned (the routing network may go back to a step), advancing (learned, but steps follow each
            other as shown), paper (the paper's networks and one fit, no search), act3d and rvt (regressors in
            the manner of these), rvt_ft and rvt_hdt (rvt, fine-tuned on the demonstration of a novel task),
            oracle (true object poses), expert, or one's own (my_methods:MyPolicy), joined by commas.
        episodes: scenes per task, spread over its variations.
        seed: first seed of the scenes.
        instance: seed of the demonstrated objects' shapes, sizes and colours.
        instances: whether the scenes show the same objects, or in each scene others of their kind.
        change: what the scenes differ in from the demonstrated ones, joined by commas: object_color,
            object_size, light, table_color, distractors, camera_pose, or all of these as all; errors of the
            sensors d415, calibration, knocked; two_cameras, fewer_cameras. docs/tasks.md says what they are.
        disturb: what goes wrong once in every episode: what is about to be acted on is moved by 10 cm, what
            was taken is knocked out of the hand, missed by it, or what was opened is pushed shut.
        second_try: go on after a motion that cannot be planned, up to the task's limit of actions; always
            so if disturbed.
        demonstrations: how many are shown, each but the first of another instance of the things.
        jobs: parallel processes.
        weights: folder that `imop train` wrote, for the learned policy; by default the bundled weights.
        baselines: folder of the weights of act3d, rvt, rvt_ft and rvt_hdt (docs/baselines.md); by default
            runs/baselines.
        robot: the arm, with the Panda's hand; all but the Panda need the extra arms, in the suite tabletop.
        out: folder for the results.
    """
    from imop.evaluation.benchmark import evaluate_suite

    writable_folder(out)
    log = out / "episodes.jsonl"
    results = evaluate_suite(
        suite,
        split,
        tasks,
        methods.split(","),
        episodes,
        seed,
        instance,
        jobs,
        console,
        log,
        weights,
        change,
        instances,
        disturb,
        second_try,
        demonstrations,
        baselines,
        robot,
    )
    results.save(out)
    console.print(results.table())
    console.print(f"{out / 'report.md'}\n{out / 'results.json'}")
    return 0


app.command(reproduce)
app.command(setup)
app.command(calibrate)
app.command(serve)
app.command(name="import")(cli_data.import_)
app.command(cli_data.export)
app.command(cli_data.check)
app.command(cli_data.predict)


@app.command
def tasks(
    suite: str = "tabletop",
    split: str = "all",
    contact_sheet: Path | None = None,
    jobs: int = 2,
) -> int:
    """List tasks with their split, variations and instructions; draw them if wanted.

    Args:
        suite: tabletop, rlbench, or one's own, such as my_suite:SUITE.
        split: which of its tasks.
        contact_sheet: PNG file to draw every task in four scenes into.
        jobs: parallel processes for the drawing.
    """
    from imop.evaluation.contact_sheet import save_contact_sheet, tasks_table
    from imop.evaluation.splits import chosen_tasks

    console.print(tasks_table(chosen_tasks(suite, split, available=False), suite))
    if contact_sheet is not None:
        writable_folder(contact_sheet.parent, "contact-sheet")
        save_contact_sheet(chosen_tasks(suite, split), contact_sheet, jobs, console)
        console.print(contact_sheet)
    return 0


@app.command(name="check-task")
def check_task(task: Positional[str]) -> int:
    """Say what is wrong with a task of one's own, and how to mend it.

    Args:
        task: module:Class, or any other name of a task.
    """
    from imop.tasks.check_task import check_task as find

    with status(f"trying {task}"):
        problems = find(task)
    for problem in problems:
        console.print(problem, soft_wrap=True)
    console.print(f"{task}: {len(problems)} problems")
    return 1 if problems else 0


app.command(cli_data.assets)
app.command(view)


@app.command
def train(
    config: Annotated[TrainConfig, tyro.conf.OmitArgPrefixes],
    ablation: Annotated[Ablation, tyro.conf.OmitArgPrefixes],
    size: Literal["small", "paper"] = "small",
    recipe: RecipeName | None = None,
    jobs: int | None = None,
) -> int:
    """Train networks on shards; run again with the same arguments, it continues where it was stopped.

    Shards are written by `python -m imop.training.generate` and its neighbours, see docs/training.md. Under
    torchrun it trains on several processes or machines. A recipe makes everything from the shards on.

    Args:
        config: how to train.
        ablation: what is left out of the networks or exchanged.
        size: of the networks.
        recipe: small makes shards, all networks and their card, in some ten hours of two cores; trial tells
            in minutes whether everything runs. Goes with --out and --jobs alone.
        jobs: processes of a recipe; 2 if not given.
    """
    from imop.networks.model import PAPER, SMALL
    from imop.training.loop import train as run_training

    if recipe is not None:
        refuse_others(config, ablation, size)
        writable_folder(config.out)
        make(recipe, config.out, 2 if jobs is None else jobs, console)
        console.print(config.out)
        return 0
    if jobs is not None:
        raise InvalidInput("jobs", f"{jobs} without --recipe", "torchrun for a training on several processes")
    writable_folder(config.out)
    run_training(config, ablation.of(SMALL if size == "small" else PAPER), console=console)
    console.print(config.out)
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
        code = _fail(str(error))
    except BrokenPipeError:
        # Who reads our output has seen enough; Python would complain once more when it flushes at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 0
    except OSError as error:
        code = _fail(f"{error.filename}: {error.strerror}" if error.filename else str(error))
    except KeyboardInterrupt:
        code = 130
    sys.exit(code)


def _fail(problem: str) -> int:
    """Say it in one line; the exit code for bad input."""
    line = Text.assemble(("error:", "red"), " ", " ".join(problem.split()))
    Console(stderr=True, soft_wrap=True).print(line)
    return 2


if __name__ == "__main__":
    main()
