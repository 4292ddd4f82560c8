"""Success rates of several methods on the same demonstrations and scenes."""

from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path

from joblib import delayed
from rich.console import Console

from imop.baselines.policy import REGRESSORS
from imop.errors import AssetMissing, ImopError, InvalidInput, MissingExtra
from imop.evaluation.episodes import Episode, EpisodeLog, method_state
from imop.evaluation.jobs import parallel
from imop.evaluation.methods import make_policy
from imop.evaluation.pointing import pointing
from imop.evaluation.report import Count, Instances, Results
from imop.evaluation.rollout import rollout
from imop.evaluation.trials import Trial, change_notes, demonstration_for, most_actions, suite_trials
from imop.policy.one_shot import OneShotPolicy
from imop.tasks.expert import ExpertFailed, perform
from imop.tasks.layout import NoRoom
from imop.types import Demonstration

NOTES = (
    "One demonstration per task and variation, from a scene that is never tested.",
    "The networks of learned saw synthetic pairs and base tasks with other objects; others saw nothing.",
    "act3d and rvt are regressors in the manner of these, trained on demonstrations of base tasks; rvt_ft "
    "and rvt_hdt are fine-tuned on the demonstration of a novel task. They are told its instruction.",
    "replay, registration and learned see four 128 x 128 RGB-D views, camera poses, joint positions and "
    "the gripper; no segmentation, names or object poses.",
    "oracle carries the demonstrated poses over by the true object pose; expert reads everything.",
    "A motion that cannot be planned ends the episode as failed.",
)


SAME = (
    "Demonstrated and tested objects have the same shapes and colours, unless they are changed; poses and "
    "clutter differ."
)
OTHER = "Every scene shows other objects of the demonstrated kind: shapes, sizes and colours are drawn anew."


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
    log: Path,
    weights: Path | None = None,
    change: str = "",
    instances: Instances = "same",
    baselines: Path | None = None,
) -> Results:
    """Try every method in the same `episodes` scenes of every task.

    Args:
        suite: which suite.
        split: which of its tasks.
        tasks: only these; all if empty.
        methods: names of `METHODS`, or of one's own, see `make_policy`.
        episodes: scenes per task.
        seed: of the first scene.
        instance: of the objects.
        jobs: processes.
        console: for the progress.
        log: file of episodes; what is in it is not tried again.
        weights: of the learned policy; None for the bundled ones.
        change: what the scenes differ in, names of `tasks.changes.FACTORS` joined by commas.
        instances: whether the scenes show the demonstrated objects or others of their kind.
        baselines: folder of the regressors' weights; None for the default one.

    Raises:
        InvalidInput: for an unknown suite, split, task, method or change, or other instances where there are
            none.
        CorruptData: if the log cannot be read.
    """
    trials = suite_trials(suite, split, tasks, episodes, seed, instance, change, instances == "other")
    everything = [trial for of_task in trials.values() for trial in of_task]
    found = tried(everything, methods, jobs, console, log, weights, baselines=baselines)
    counts = {
        method: {task: count_of([found[trial, method] for trial in trials[task]]) for task in trials}
        for method in methods
    }
    names = ",".join(tasks) or split
    notes = (*NOTES, OTHER if instances == "other" else SAME, *change_notes(trials, change))
    return Results(suite, names, seed, counts, notes, change, instances)


def tried(
    trials: Sequence[Trial],
    methods: Sequence[str],
    jobs: int,
    console: Console,
    log: Path,
    weights: Path | None = None,
    focus: bool = False,
    baselines: Path | None = None,
) -> dict[tuple[Trial, str], Episode]:
    """The episode of every method in every scene: from the log, or tried now and added to it.

    What the log has of other code or weights is tried again. If `focus`, somebody points at the thing that is
    acted on first, in demonstration and scene. For the other arguments see `evaluate_suite`.

    Raises:
        InvalidInput: for an unknown task or method, or one that nobody can point out things to.
        CorruptData: if the log cannot be read.
        ExpertFailed, NoRoom: if there is no demonstration for a scene.
    """
    folders = {method: baselines if method in REGRESSORS else weights for method in methods}
    for method in methods:
        if method not in ("oracle", "expert"):
            policy = make_policy(
                method, weights=folders[method]
            )  # what is missing is said before anything is tried
        if focus and (method in ("oracle", "expert") or not isinstance(policy, OneShotPolicy)):
            raise InvalidInput("focus", f"{method} takes none", "learned, routed, registration, textbook")
    known = EpisodeLog(log)
    state = cache(
        lambda task, method: method_state(method, folders[method], task) + ("-focus" if focus else "")
    )
    wanted = [(trial, method, state(trial.task, method)) for trial in trials for method in methods]
    missing = [one for one in wanted if known.find(*one) is None]
    shown = _demonstrations([trial for trial, _, _ in missing], jobs, console)
    work = [
        delayed(attempt)(one[0], shown[shown_together(one[0])], *one[1:], folders[one[1]], focus)
        for one in missing
    ]
    for episode in parallel(work, jobs, console, "episodes"):
        known.add(episode)
    episodes = (known.find(*one) for one in wanted)
    return {(episode.trial, episode.method): episode for episode in episodes if episode is not None}


def attempt(
    trial: Trial,
    demonstration: Demonstration,
    method: str,
    state: str,
    weights: Path | None = None,
    focus: bool = False,
) -> Episode:
    """How a method that was shown the demonstration does in one scene; for the arguments see `tried`."""
    try:
        env = trial.env()
    except NoRoom as error:
        return Episode(trial, method, state, None, str(error))
    try:
        if method == "expert":
            perform(env.task, env.world)
            return Episode(trial, method, state, True, "success", len(demonstration))
        policy = make_policy(method, env.world, weights=weights)
        point = pointing(demonstration) if focus else None
        if point is not None:
            assert isinstance(policy, OneShotPolicy)
            meant = point(0, demonstration.keyframes[0].observation)
            policy.watch(demonstration.stripped(), meant)
        else:
            policy.watch(demonstration if method == "oracle" else demonstration.stripped())
        result = rollout(env, policy, most_actions(method, demonstration, env.task), point=point)
    except (MissingExtra, AssetMissing):
        raise  # says nothing about the method
    except ImopError as error:
        # What a policy cannot handle it has failed at; the other methods and scenes go on.
        return Episode(trial, method, state, False, str(error), error=not isinstance(error, ExpertFailed))
    decisions = tuple((step.generator, step.confidence) for step in result.steps)
    return Episode(trial, method, state, result.success, result.reason, len(result.steps), decisions)


def count_of(episodes: Iterable[Episode]) -> Count:
    """Successes among those episodes that had a scene."""
    known = [episode.success for episode in episodes if episode.success is not None]
    return Count(sum(known), len(known))


def shown_together(trial: Trial) -> tuple[str, int, int, str]:
    """What trials with the same demonstration have in common."""
    shown = trial.demonstrated
    return shown.task, shown.variation, shown.instance, shown.change


def _demonstrations(
    trials: list[Trial], jobs: int, console: Console
) -> dict[tuple[str, int, int, str], Demonstration]:
    wanted = {shown_together(trial): trial for trial in trials}
    work = [delayed(demonstration_for)(trial) for trial in wanted.values()]
    return dict(zip(wanted, parallel(work, jobs, console, "demonstrations"), strict=True))
