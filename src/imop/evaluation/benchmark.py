"""Success rates of several methods on the same demonstrations and scenes."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed
from rich.console import Console
from rich.progress import MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from imop.errors import ImopError, InvalidInput
from imop.evaluation.report import Count, Results
from imop.evaluation.rollout import rollout
from imop.evaluation.trials import Trial, demonstration_for, make_policy, most_actions, suite_trials
from imop.tasks.expert import ExpertFailed, perform
from imop.tasks.layout import NoRoom
from imop.types import Demonstration

METHODS = ("replay", "registration", "learned", "routed", "oracle", "expert")

NOTES = (
    "One demonstration per task and variation, from a scene that is never tested.",
    "The networks of learned saw synthetic pairs and base tasks with other objects; others saw nothing.",
    "Demonstrated and tested objects have the same shapes and colours; poses and clutter differ.",
    "replay, registration and learned see four 128 x 128 RGB-D views, camera poses, joint positions and "
    "the gripper; no segmentation, names or object poses.",
    "oracle carries the demonstrated poses over by the true object pose; expert reads everything.",
    "A motion that cannot be planned ends the episode as failed.",
)


def evaluate_suite(
    suite: str,
    split: str,
    tasks: tuple[str, ...],
    methods: list[str],
    episodes: int,
    seed: int,
    instance: int,
    jobs: int,
    console: Console,
    weights: Path | None = None,
) -> Results:
    """Try every method in the same `episodes` scenes of every task.

    Raises:
        InvalidInput: for an unknown suite, split, task or method.
    """
    if unknown := [method for method in methods if method not in METHODS]:
        raise InvalidInput("methods", unknown[0], ", ".join(METHODS))
    trials = suite_trials(suite, split, tasks, episodes, seed, instance)
    every = [trial for of_task in trials.values() for trial in of_task]
    shown = _demonstrations(every, jobs, console)
    work = [delayed(outcomes)(trial, shown[_shared(trial)], methods, weights) for trial in every]
    results = dict(zip(every, parallel(work, jobs, console, "episodes"), strict=True))
    counts = {
        method: {
            task: _count([results[trial][method] for trial in of_task if results[trial]])
            for task, of_task in trials.items()
        }
        for method in methods
    }
    return Results(suite, ",".join(tasks) or split, seed, counts, NOTES)


def outcomes(
    trial: Trial, demonstration: Demonstration, methods: Iterable[str], weights: Path | None = None
) -> dict[str, bool]:
    """Success of each method in one scene; empty if the objects of the scene find no place."""
    try:
        return {method: _succeeds(trial, demonstration, method, weights) for method in methods}
    except NoRoom:
        return {}


def _succeeds(trial: Trial, demonstration: Demonstration, method: str, weights: Path | None) -> bool:
    env = trial.env()
    if method == "expert":
        try:
            perform(env.task, env.world)
        except ExpertFailed:
            return False
        return True
    policy = make_policy(method, env.world, weights=weights)
    try:
        policy.watch(demonstration if method == "oracle" else demonstration.stripped())
        return rollout(env, policy, most_actions(method, demonstration, env.task)).success
    except ImopError:
        # What a policy cannot handle it has failed at; the other methods and scenes go on.
        return False


def _count(successes: list[bool]) -> Count:
    return Count(sum(successes), len(successes))


def _shared(trial: Trial) -> tuple[str, int, int]:
    """What trials with the same demonstration have in common."""
    return trial.task, trial.variation, trial.instance


def _demonstrations(
    trials: list[Trial], jobs: int, console: Console
) -> dict[tuple[str, int, int], Demonstration]:
    wanted = {_shared(trial): trial for trial in trials}
    work = [delayed(demonstration_for)(trial) for trial in wanted.values()]
    return dict(zip(wanted, parallel(work, jobs, console, "demonstrations"), strict=True))


def parallel(work: list[Any], jobs: int, console: Console, title: str) -> Iterator[Any]:
    """Results of joblib's delayed calls in order, computed by `jobs` processes, with a progress bar."""
    columns = (TextColumn(title), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as progress:
        yield from progress.track(Parallel(n_jobs=jobs, return_as="generator")(work), total=len(work))
