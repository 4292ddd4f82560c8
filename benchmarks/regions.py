"""How often Eq. (3) finds the object that the task needs, with no annotation, on the embedded suite.

    python benchmarks/regions.py --episodes 4 --json regions.json

Every task is demonstrated `episodes` times with the same objects, for several sets of objects. Each of these
demonstrations in turn is the support, the others are its partners. What the task needs is what its waypoint
is fixed to; what really stays in place with the action is known from the poses of all things.
"""

import sys
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from joblib import delayed
from rich.console import Console
from rich.table import Table

from imop.demos.regions import BACKGROUND, SegmentedState, invariant_region, segmented
from imop.evaluation.collect import COLLECTION_SEED, RETRY_STRIDE
from imop.evaluation.jobs import parallel
from imop.evaluation.report import save_json
from imop.evaluation.splits import chosen_tasks
from imop.geometry import se3
from imop.sim.world import World
from imop.tasks.env import make_task
from imop.tasks.expert import ExpertFailed, perform
from imop.tasks.layout import NoRoom
from imop.tasks.task import make_scene
from imop.types import Demonstration, FloatArray

_FIRST = COLLECTION_SEED + 1_000_000
"""Seeds that nothing is trained on."""
_PLACE, _TURN = 0.008, np.radians(4.0)


@dataclass
class Options:
    """Settings of the benchmark.

    Attributes:
        episodes: demonstrations with the same objects.
        objects: sets of objects per task, its variations in turn.
        suite: which suite.
        split: which of its tasks.
        tasks: names within the split; all if none is given.
        json: where the results go.
        jobs: processes.
    """

    episodes: int = 4
    objects: int = 2
    suite: str = "tabletop"
    split: str = "all"
    tasks: tuple[str, ...] = ()
    json: Path | None = None
    jobs: int = 2


@dataclass
class Truth:
    """What only the simulator knows of a demonstration, by step.

    Attributes:
        needed: name of the instance that the waypoint is fixed to.
        poses: instance -> T_world_instance (4, 4).
        segments: the observed objects in the frame of the action.
        goals: T_world_goal (4, 4).
    """

    needed: list[str]
    poses: list[dict[str, FloatArray]]
    segments: list[SegmentedState]
    goals: list[FloatArray]


@dataclass
class Score:
    """Steps of one task: how many, and in how many the region is right.

    Attributes:
        steps: counted for every support.
        found: the needed object is in the region.
        exact: the region is all that is seen and stays in place, and nothing else.
        misses: what went wrong -> how often.
    """

    steps: int = 0
    found: int = 0
    exact: int = 0
    misses: Counter[str] = field(default_factory=Counter)

    def as_dict(self) -> dict[str, Any]:
        """The layout of the report."""
        return {**vars(self), "misses": dict(self.misses)}


class _Watched:
    """A task that notes where everything is whenever the expert asks for its next waypoint."""

    def __init__(self, task: Any):
        self._task, self.poses = task, []

    def __getattr__(self, name: str) -> Any:
        return getattr(self._task, name)

    def waypoints(self, world: World) -> Any:
        names = [name for name in world.instance_names.values() if name not in BACKGROUND]
        self.poses.append({name: world.pose(name) for name in names})
        return self._task.waypoints(world)


def demonstrated(name: str, variation: int, instance: int, scene: int) -> Truth | None:
    """One demonstration; None if the expert fails in every scene."""
    for attempt in range(5):
        task = make_task(name)
        try:
            world = make_scene(task, variation, instance, scene + attempt * RETRY_STRIDE)
            watched = _Watched(task)
            demonstration: Demonstration = perform(watched, world)
        except (ExpertFailed, NoRoom):
            continue
        keyframes = demonstration.keyframes
        return Truth(
            [
                world.instance_names[int(world.instances[world.model.body(k.object_name).id])]
                for k in keyframes
            ],
            watched.poses[1:],
            [segmented(k) for k in keyframes],
            [k.action.T_world_gripper for k in keyframes],
        )
    return None


def rigid(support: Truth, partners: list[Truth], step: int) -> set[str]:
    """What is seen and stays in place with the action of a step in all demonstrations."""
    found = set(support.segments[step].names)
    for partner in partners:
        M = partner.goals[step] @ se3.invert(support.goals[step])
        for name in tuple(found):
            T, moved = partner.poses[step].get(name), M @ support.poses[step][name]
            if (
                T is None
                or se3.translation_distance(T, moved) > _PLACE
                or se3.rotation_distance(T, moved) > _TURN
            ):
                found.discard(name)
    return found


def scored(truths: list[Truth]) -> Score:
    """All steps of demonstrations with the same objects, each of them the support once."""
    score = Score()
    for support in truths:
        partners = [t for t in truths if t is not support]
        for step, needed in enumerate(support.needed):
            region = invariant_region(support.segments[step], [t.segments[step] for t in partners])
            true = rigid(support, partners, step)
            score.steps += 1
            score.found += needed in region.names
            score.exact += set(region.names) == true
            if needed not in region.names:
                seen = needed in support.segments[step].names
                apart = region.displacement.get(needed)
                how = (
                    "hidden"
                    if not seen
                    else "no partner sees it"
                    if apart is None
                    else f"{1000 * apart:.0f} mm"
                )
                score.misses[f"step {step}, {needed}: {how}; instead {', '.join(region.names)}"] += 1
            elif set(region.names) != true:
                extra, missing = set(region.names) - true, true - set(region.names)
                score.misses[f"step {step}: also {sorted(extra)}, without {sorted(missing)}"] += 1
    return score


def main() -> int:
    options = tyro.cli(Options, description=__doc__)
    console = Console()
    tasks = chosen_tasks(options.suite, options.split, options.tasks)
    keys = [
        (task, i % make_task(task).variations, _FIRST + i, _FIRST + options.episodes * i + j)
        for task in tasks
        for i in range(options.objects)
        for j in range(options.episodes)
    ]
    shown = list(parallel([delayed(demonstrated)(*k) for k in keys], options.jobs, console, "demonstrations"))
    scores = {task: Score() for task in tasks}
    for start in range(0, len(keys), options.episodes):
        truths = [t for t in shown[start : start + options.episodes] if t is not None]
        if len(truths) > 1:
            new, score = scored(truths), scores[keys[start][0]]
            score.steps, score.found = score.steps + new.steps, score.found + new.found
            score.exact, score.misses = score.exact + new.exact, score.misses + new.misses
    table = Table(title="discovered regions")
    for column in ("task", "steps", "needed object found", "exactly what stays in place"):
        table.add_column(column, justify="left" if column == "task" else "right")
    total = Score(*(sum(getattr(s, name) for s in scores.values()) for name in ("steps", "found", "exact")))
    for task, score in (*scores.items(), ("all", total)):
        shares = (f"{n} ({100 * n / max(score.steps, 1):.1f} %)" for n in (score.found, score.exact))
        table.add_row(task.removeprefix(f"{options.suite}/"), f"{score.steps}", *shares)
    console.print(table)
    for task, score in scores.items():
        for miss, count in score.misses.most_common():
            console.print(f"{task}: {count} x {miss}", highlight=False, soft_wrap=True)
    if options.json:
        written = {task: score.as_dict() for task, score in (*scores.items(), ("all", total))}
        save_json(written, options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
