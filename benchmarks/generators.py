"""What each generator of the search brings: poses found without it, on tabletop base tasks, seeds below 1000.

    python benchmarks/generators.py --scenes 6 --jobs 2 --weights FOLDER --json FILE

Every generator is left out alone. The policy is told the step and asked for it in recorded scenes with the
demonstrated things and with other instances of them; its own answer is passed on to the next step. A pose is
right within 2 cm and 10 degrees of one that is as right as the recorded one (`evaluation/equal_poses.py`).

Intervals are Wilson's. A generator brings the poses that are lost without it less those that are won; the
intervals of both shares make that of the difference (Newcombe, Statistics in Medicine 1998).
"""

import math
import shlex
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
import torch
import tyro
from joblib import delayed
from rich.console import Console

from imop.errors import ImopError, InvalidInput, NoConfidentMatch
from imop.evaluation.appearance import Appearance
from imop.evaluation.equal_poses import equal_poses
from imop.evaluation.jobs import parallel
from imop.evaluation.recordings import Recordings, objects_world
from imop.evaluation.report import save_json
from imop.evaluation.robots import robot_functions
from imop.evaluation.statistics import wilson
from imop.evaluation.trials import Trial, suite_trials
from imop.files import user_cache
from imop.geometry.accuracy import COARSE, errors
from imop.geometry.perception import Perception
from imop.networks.model import BUNDLED, Model, load_model
from imop.policy.interfaces import BEGINNING, PolicyConfig, Progress, Scene
from imop.policy.learned import LearnedMatcher
from imop.policy.one_shot import OneShotPolicy
from imop.tasks.expert import ExpertFailed
from imop.tasks.layout import NoRoom
from imop.types import Demonstration, FloatArray

GENERATORS = (
    "hint",
    "gripper",
    "fit",
    "firm",
    "matches",
    "upright",
    "anywhere",
    "turn",
    "half_turn",
    "straight",
    "exact",
    "part",
    "payload",
    "goal",
)
"""Of `policy/proposals.py`."""
CONFIGURATIONS = ("", *GENERATORS)
"""What is left out: nothing, then one generator at a time."""
SCENES = 1000
"""Seeds from here on are for tests."""


@dataclass
class Options:
    """Settings of the benchmark.

    Attributes:
        tasks: comma-separated names of tabletop base tasks; all by default.
        scenes: per task, with its variations in turn; as many with the same as with other things.
        weights: of the networks.
        json: where the results and every single answer go.
        cache: where recorded scenes are kept.
        jobs: processes.
    """

    tasks: str = ""
    scenes: int = 6
    weights: Path = BUNDLED
    json: Path | None = None
    cache: Path = field(default_factory=user_cache)
    jobs: int = 1


@dataclass(frozen=True)
class Row:
    """One answer.

    Attributes:
        without: the generator that was left out; empty if none was.
        task: its name.
        variation: of the task.
        scene: seed of the query.
        other: whether it shows another instance of the things.
        step: of the demonstration.
        generator: who proposed the answer; empty if there is none.
        right: whether a right pose is near.
    """

    without: str
    task: str
    variation: int
    scene: int
    other: bool
    step: int
    generator: str
    right: bool


@dataclass(frozen=True, eq=False)
class Query:
    """A recorded scene, with what is right in it.

    Attributes:
        trial: which scene.
        scenes: as the policy sees the state before each step.
        right: for each step (N, 4, 4) T_world_gripper of the right poses.
    """

    trial: Trial
    scenes: list[Scene]
    right: list[FloatArray]


def policy_without(generator: str, model: Model) -> OneShotPolicy:
    """The learned policy whose search does not ask a generator, or asks all if it is empty."""
    is_robot, reachable = robot_functions()
    matcher = LearnedMatcher(model, PolicyConfig(without=tuple(filter(None, [generator]))))
    return OneShotPolicy(matcher, Perception(is_robot), feasible=reachable)


def task_rows(trials: Sequence[Trial], weights: Path, cache: Path) -> list[Row]:
    """Every configuration asked in the trials of one task and variation, which share the demonstration."""
    torch.set_num_threads(1)
    recordings = Recordings(cache, trials[0].task)
    try:
        shown = recordings.demonstration(trials[0])
    except (ExpertFailed, NoRoom) as error:
        print(f"left out: {error}", file=sys.stderr)
        return []
    found: list[Row] = []
    queries: list[Query] = []
    model = load_model(weights)
    for without in CONFIGURATIONS:
        policy = policy_without(without, model)
        policy.watch(shown.stripped())
        # What is seen depends on the demonstration, which tells of the cameras, and on no generator.
        queries = queries or list(seen(policy, recordings, trials, len(shown)))
        for query in queries:
            found += answers(policy, without, query)
    return found


def seen(
    policy: OneShotPolicy, recordings: Recordings, trials: Sequence[Trial], steps: int
) -> Iterator[Query]:
    """The scenes of trials that the expert succeeds in."""
    for trial in trials:
        recorded = recordings.scene(trial)
        if recorded is not None:
            keyframes = recorded.keyframes[:steps]
            scenes = [policy.see(keyframe.observation.stripped()) for keyframe in keyframes]
            yield Query(trial, scenes, right_poses(trial, recorded, len(scenes)))


def right_poses(trial: Trial, recorded: Demonstration, steps: int) -> list[FloatArray]:
    """For each step (N, 4, 4) T_world_gripper of what is right, by the looks of the scene's own things."""
    appearance = Appearance(objects_world(trial))
    return [equal_poses(recorded, step, appearance) for step in range(steps)]


def answers(policy: OneShotPolicy, without: str, query: Query) -> Iterator[Row]:
    """One row for each step of a scene."""
    trial, progress = query.trial, BEGINNING
    for step, (scene, right) in enumerate(zip(query.scenes, query.right, strict=True)):
        generator, hit = "", False
        with suppress(NoConfidentMatch):
            action = policy.locate(scene, step, progress=progress)
            assert action.match is not None
            progress = Progress(action.match.T_query_support)
            position, rotation = errors(action.T_world_gripper, right)
            generator = action.match.generator
            hit = position < COARSE[0] and rotation < np.radians(COARSE[1])
        other = trial.shown is not None
        yield Row(without, trial.task, trial.variation, trial.seed, other, step, generator, bool(hit))


def groups(options: Options) -> list[list[Trial]]:
    """Trials that share a demonstration: those of a task and variation, with the same and other things.

    Raises:
        InvalidInput: for an unknown task, or a number of scenes out of range.
    """
    if options.scenes > SCENES:
        raise InvalidInput("scenes", f"{options.scenes}", f"1 to {SCENES}: later seeds are for tests")
    tasks = tuple(filter(None, options.tasks.split(",")))
    found: dict[tuple[str, int], list[Trial]] = {}
    for other in (False, True):
        trials = suite_trials("tabletop", "base", tasks, options.scenes, 0, 0, other=other)
        for trial in (trial for some in trials.values() for trial in some):
            found.setdefault((trial.task, trial.variation), []).append(trial)
    return list(found.values())


def share(right: Sequence[bool]) -> dict[str, object]:
    """How often it was right."""
    count, n = sum(right), len(right)
    return {"right": count, "n": n, "share": count / n, "interval": wilson(count, n)}


def difference(full: Sequence[bool], less: Sequence[bool]) -> dict[str, object]:
    """What the share of right answers gains by a generator, from the same steps with and without it."""
    n = len(full)
    lost = sum(a and not b for a, b in zip(full, less, strict=True))
    won = sum(b and not a for a, b in zip(full, less, strict=True))
    (lost_low, lost_high), (won_low, won_high) = wilson(lost, n), wilson(won, n)
    gain = (lost - won) / n
    low = gain - math.hypot(lost / n - lost_low, won_high - won / n)
    high = gain + math.hypot(lost_high - lost / n, won / n - won_low)
    return {"lost": lost, "won": won, "difference": gain, "interval": (low, high)}


def summary(rows: Sequence[Row]) -> dict[str, dict[str, dict[str, object]]]:
    """For each generator that was left out (empty: none): same and other things, and what it brings.

    Raises:
        InvalidInput: if there are no scenes with the same things, or none with others.
    """
    if len({row.other for row in rows}) < 2:
        raise InvalidInput("scenes", "the expert fails in all with the same or with other things", "more")
    order = sorted(rows, key=lambda r: (r.other, r.task, r.variation, r.scene, r.step))
    full = [row.right for row in order if not row.without]
    found = {}
    for without in CONFIGURATIONS:
        mine = [row for row in order if row.without == without]
        found[without] = {
            "same": share([row.right for row in mine if not row.other]),
            "other": share([row.right for row in mine if row.other]),
            "brings": difference(full, [row.right for row in mine]),
        }
    return found


def markdown(found: dict[str, dict[str, dict]]) -> str:
    """The table of a report."""

    def cell(of: dict) -> str:
        low, high = of["interval"]
        return f"{100 * of['share']:.1f} % [{100 * low:.0f}, {100 * high:.0f}]"

    n = found[""]["same"]["n"], found[""]["other"]["n"]
    lines = [
        f"| without | same things (n = {n[0]}) | other instances (n = {n[1]}) | brings, of both | lost, won |"
    ]
    lines.append("|---|---|---|---|---|")
    for without, of in found.items():
        brings = of["brings"]
        low, high = brings["interval"]
        gain = f"{100 * brings['difference']:+.1f} % [{100 * low:+.1f}, {100 * high:+.1f}]"
        changed = f"{gain} | {brings['lost']}, {brings['won']}" if without else "|"
        name = f"`{without}`" if without else "none"
        lines.append(f"| {name} | {cell(of['same'])} | {cell(of['other'])} | {changed} |")
    return "\n".join(lines)


def main() -> int:
    options = tyro.cli(Options, description=__doc__)
    console = Console(stderr=True)
    try:
        work = [delayed(task_rows)(trials, options.weights, options.cache) for trials in groups(options)]
        rows = [row for some in parallel(work, options.jobs, console, "demonstrations") for row in some]
        found = summary(rows)
    except ImopError as error:
        console.print(f"[red]{error}")
        return 2
    print(markdown(found))
    if options.json:
        command = shlex.join(["python", *sys.argv])
        save_json({"without": found, "command": command, "rows": [asdict(r) for r in rows]}, options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
