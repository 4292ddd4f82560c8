"""Success rates of several methods on the same demonstrations and scenes."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from joblib import delayed
from rich.console import Console

from imop.baselines.policy import REGRESSORS
from imop.errors import AssetMissing, ImopError, InvalidInput, MissingExtra
from imop.evaluation.config import EvaluationConfig
from imop.evaluation.episodes import Episode, EpisodeLog, method_state
from imop.evaluation.jobs import parallel
from imop.evaluation.methods import Policy, make_policy
from imop.evaluation.pointing import pointing
from imop.evaluation.report import Count, Results
from imop.evaluation.rollout import rollout
from imop.evaluation.trials import (
    Trial,
    change_notes,
    demonstrations_for,
    disturbed,
    most_actions,
    suite_trials,
)
from imop.policy.one_shot import OneShotPolicy
from imop.sim.arms import PANDA, find_arm
from imop.tasks.disturbances import DISTURBANCES
from imop.tasks.expert import ExpertFailed, perform
from imop.tasks.layout import NoRoom
from imop.types import Demonstration

NOTES = (
    "Demonstrations are per task and variation, from scenes that are never tested.",
    "The networks of learned saw synthetic pairs and base tasks with other objects; others saw nothing.",
    "act3d and rvt are regressors in the manner of these, trained on demonstrations of base tasks; rvt_ft "
    "and rvt_hdt are fine-tuned on the demonstration of a novel task. They are told its instruction.",
    "replay, registration and learned see four 128 x 128 RGB-D views, camera poses, joint positions and "
    "the gripper; no segmentation, names or object poses.",
    "oracle carries the demonstrated poses over by the true object pose; expert reads everything.",
)

ENDS = "A motion that cannot be planned ends the episode as failed."
SECOND_TRY = "An episode goes on after a motion that cannot be planned, up to the task's limit of actions."


SAME = (
    "Demonstrated and tested objects have the same shapes and colours, unless they are changed; poses and "
    "clutter differ."
)
OTHER = "Every scene shows other objects of the demonstrated kind: shapes, sizes and colours are drawn anew."


def evaluate_suite(config: EvaluationConfig, console: Console) -> Results:
    """Try every method in the same scenes of every task.

    Every episode is kept in `config.out`/episodes.jsonl, and what is in it is not tried again.

    Args:
        config: which methods and scenes.
        console: for the progress.

    Raises:
        InvalidInput: for an unknown suite, split, task, method, change, disturbance or robot, no
            demonstration, or other instances or robots where there are none.
        MissingExtra: if the robot's model is not installed.
        CorruptData: if the log cannot be read.
    """
    c, methods = config, config.methods.split(",")
    possible = _scenes(config)
    trials = disturbed(possible, c.disturb) if c.disturb else possible
    everything = [trial for of_task in trials.values() for trial in of_task]
    log = c.out / "episodes.jsonl"
    found = tried(everything, methods, c.jobs, console, log, c.weights, baselines=c.baselines)
    counts = {
        method: {task: count_of([found[trial, method] for trial in trials[task]]) for task in trials}
        for method in methods
    }
    notes = [*_notes(config), *change_notes(trials, c.change)]
    if c.disturb:
        notes += disturbance_notes(c.disturb, found, sorted(set(possible) - set(trials)))
    names = ",".join(c.tasks) or c.split
    return Results(c.suite, names, c.seed, counts, tuple(notes), c.change, c.instances, c.disturb)


def _scenes(config: EvaluationConfig) -> dict[str, list[Trial]]:
    """Of every task, before anything is disturbed."""
    c = config
    if c.robot != PANDA.name and c.suite == "rlbench":
        raise InvalidInput("robot", f"{c.robot} in suite {c.suite}", "panda; other arms in suite tabletop")
    robot = find_arm(c.robot).name
    trials = suite_trials(
        c.suite, c.split, c.tasks, c.episodes, c.seed, c.instance, c.change, c.instances == "other"
    )

    def as_wanted(trial: Trial) -> Trial:
        return replace(trial, second_try=c.second_try, demonstrations=c.demonstrations, robot=robot)

    return {task: list(map(as_wanted, of_task)) for task, of_task in trials.items()}


def _notes(config: EvaluationConfig) -> list[str]:
    """How the episodes were tried."""
    notes = [*NOTES, SECOND_TRY if config.second_try or config.disturb else ENDS]
    notes += [OTHER if config.instances == "other" else SAME]
    if config.demonstrations > 1:
        notes += [f"Shown were {config.demonstrations} demonstrations, each of another instance."]
    if config.robot != PANDA.name:
        notes += [f"The arm is the {config.robot}, with the Panda's hand."]
    return notes


def disturbance_notes(
    disturb: str, episodes: Mapping[tuple[Trial, str], Episode], without: Sequence[str]
) -> list[str]:
    """What a disturbance means, how often it happened, and in which tasks it cannot."""
    notes = [f"{disturb}: {DISTURBANCES[disturb]}"]
    for method in dict.fromkeys(method for _, method in episodes):
        own = [e for (_, m), e in episodes.items() if m == method and e.success is not None]
        notes.append(f"With {method} it happened in {sum(e.disturbed for e in own)} of {len(own)} episodes.")
    return notes + [f"It cannot happen in {', '.join(without)}."] * bool(without)


_Wanted = tuple[Trial, str, str, Path | None]
"""A scene, a method, its state, and the folder of its weights."""
_AT_ONCE = 25
"""Episodes that are tried and logged together, at most."""


@dataclass(frozen=True)
class Shown:
    """What a policy is shown.

    Attributes:
        key: by which it is told from others, see `shown_together`.
        demonstrations: one or more.
    """

    key: tuple[str, int, int, str, int, str]
    demonstrations: tuple[Demonstration, ...] = field(compare=False)


def tried(
    trials: Sequence[Trial],
    methods: Sequence[str],
    jobs: int,
    console: Console,
    log: Path,
    weights: Path | None = None,
    focus: bool = False,
    baselines: Path | None = None,
    kept: Path | None = None,
) -> dict[tuple[Trial, str], Episode]:
    """The episode of every method in every scene: from the log, or tried now and added to it.

    What the log has of other code or weights is tried again. If `focus`, somebody points at the thing that is
    acted on first, in demonstration and scene. Demonstrations are kept for the next time in the folder
    `kept`, if there is one, see `demonstration_for`. For the other arguments see `EvaluationConfig`.

    Raises:
        InvalidInput: for an unknown task or method, or one that nobody can point out things to.
        CorruptData: if the log cannot be read.
        ExpertFailed, NoRoom: if there is no demonstration for a scene.
    """
    folders = {method: baselines if method in REGRESSORS else weights for method in methods}
    for method in methods:
        if method not in ("oracle", "expert"):
            # What is missing is said before anything is tried.
            policy = make_policy(method, weights=folders[method])
        if focus and (method in ("oracle", "expert") or not isinstance(policy, OneShotPolicy)):
            raise InvalidInput("focus", f"{method} takes none", "learned, advancing, registration, textbook")
    known = EpisodeLog(log)
    state = cache(
        lambda task, method: method_state(method, folders[method], task) + ("-focus" if focus else "")
    )
    wanted = [(trial, method, state(trial.task, method)) for trial in trials for method in methods]
    missing = [(*one, folders[one[1]]) for one in wanted if known.find(*one) is None]
    work = [delayed(_attempts)(these, focus, kept) for these in _together(missing)]
    for tried_together in parallel(work, jobs, console, "episodes, some at a time"):
        for episode in tried_together:
            known.add(episode)
    episodes = (known.find(*one) for one in wanted)
    return {(episode.trial, episode.method): episode for episode in episodes if episode is not None}


def _together(missing: Sequence[_Wanted]) -> list[list[_Wanted]]:
    """What one process tries, one after another: who watched a demonstration acts in many of its scenes."""
    groups: dict[tuple[Any, ...], list[_Wanted]] = {}
    for one in missing:
        groups.setdefault(shown_together(one[0]), []).append(one)
    sorted_groups = [sorted(group, key=lambda one: one[1]) for group in groups.values()]
    return [group[i : i + _AT_ONCE] for group in sorted_groups for i in range(0, len(group), _AT_ONCE)]


def _attempts(wanted: Sequence[_Wanted], focus: bool, kept: Path | None) -> list[Episode]:
    """What happens in scenes that share their demonstrations."""
    trial = wanted[0][0]
    shown = Shown(shown_together(trial), tuple(demonstrations_for(trial, kept)))
    return [attempt(trial, shown, method, state, weights, focus) for trial, method, state, weights in wanted]


def attempt(
    trial: Trial,
    shown: Shown,
    method: str,
    state: str,
    weights: Path | None = None,
    focus: bool = False,
) -> Episode:
    """How a method that was shown some demonstrations does in one scene; for the arguments see `tried`."""
    try:
        env = trial.env()
    except NoRoom as error:
        return Episode(trial, method, state, None, str(error))
    try:
        first = shown.demonstrations[0]
        if method == "expert":
            perform(env.task, env.world)
            return Episode(trial, method, state, True, "success", len(first))
        point = pointing(first) if focus else None
        if method == "oracle":
            policy = make_policy(method, env.world)
            policy.watch(first)
        else:
            policy = _watched(shown, method, state, weights, focus, trial.robot)
        result = rollout(env, policy, most_actions(method, first, trial, env.task), point=point)
    except (MissingExtra, AssetMissing):
        raise  # says nothing about the method
    except NoRoom as error:
        return Episode(trial, method, state, None, str(error))
    except ImopError as error:
        # What a policy cannot handle it has failed at; the other methods and scenes go on.
        return Episode(trial, method, state, False, str(error), error=not isinstance(error, ExpertFailed))
    decisions = tuple((step.generator, step.confidence) for step in result.steps)
    happened = any(step.disturbed for step in result.steps)
    ended = result.success, result.reason, len(result.steps), decisions
    return Episode(trial, method, state, *ended, disturbed=happened)


def count_of(episodes: Iterable[Episode]) -> Count:
    """Successes among those episodes that had a scene."""
    known = [episode.success for episode in episodes if episode.success is not None]
    return Count(sum(known), len(known))


@lru_cache(maxsize=1)
def _watched(shown: Shown, method: str, state: str, weights: Path | None, focus: bool, robot: str) -> Policy:
    """A policy that was shown the demonstrations, for watching takes as long as an episode.

    The state tells it from one of other weights in the same folder.
    """
    policy = make_policy(method, weights=weights, robot=robot)
    first, *others = shown.demonstrations
    if focus:
        assert isinstance(policy, OneShotPolicy)
        policy.watch(first.stripped(), pointing(first)(0, first.keyframes[0].observation))
    else:
        for demonstration in (first, *others):
            policy.watch(demonstration.stripped())
    return policy


def shown_together(trial: Trial) -> tuple[str, int, int, str, int, str]:
    """What trials with the same demonstrations have in common."""
    shown = trial.demonstrated
    return shown.task, shown.variation, shown.instance, shown.change, shown.demonstrations, shown.robot
