"""Whether a task is fit to learn and to measure with, in the manner of Gymnasium's `check_env`."""

from collections.abc import Iterator, Sequence

import numpy as np

from imop.errors import PlanFailed
from imop.sim.world import World
from imop.tasks.checks import overlaps
from imop.tasks.env import make_task
from imop.tasks.expert import ExpertFailed, perform
from imop.tasks.layout import NoRoom
from imop.tasks.task import Task, make_scene
from imop.types import FloatArray

SEEDS = (0, 1, 2)
_AT_REST = 250
"""Steps of the simulation, half a second."""
_UNMOVING = ("world", "table")


def check_task(task: str | type[Task], seeds: Sequence[int] = SEEDS) -> list[str]:
    """What is wrong with a task, and how to mend it; empty if nothing was found.

    Tries one scene a seed, with the variations in turn: the untouched scene is sound and no success, the
    expert succeeds, waypoints depend on what cameras see, and scenes on their seeds alone.

    Args:
        task: its name as for `make_task`, or the class.
        seeds: of scenes and objects, two at least.

    Raises:
        InvalidInput: if there is no such task.
        AssetMissing, MissingExtra: if it needs what is not there.
    """
    made = make_task(task) if isinstance(task, str) else task()
    made.name = made.name or type(made).__name__
    return [*_words(made), *_repeatable(made, seeds[0], seeds[-1]), *_scenes(made, seeds)]


def _words(task: Task) -> Iterator[str]:
    if task.variations < 1:
        yield f"variations is {task.variations}: there has to be one at least"
    words = [tuple(task.instructions(variation)) for variation in range(task.variations)]
    for variation, texts in enumerate(words):
        if not texts or not all(isinstance(text, str) and text for text in texts):
            yield f"instructions({variation}) is {texts}: return a tuple of sentences, the usual one first"
    if len(set(words)) < len(words):
        yield "instructions are the same for several variations: say what each of them aims at"


def _repeatable(task: Task, seed: int, other: int) -> Iterator[str]:
    try:
        first, again, elsewhere = (_places(task, s) for s in (seed, seed, other))
    except NoRoom as error:
        yield f"no scene was found for seed {seed} or {other} ({error}): ask for less room, or reach nearer"
        return
    if not np.array_equal(first, again):
        yield f"two scenes of seed {seed} differ: draw everything from the generator that reset is given"
    if np.array_equal(first, elsewhere):
        yield f"waypoints are where they were, seed {seed} or {other}: place things at random in reset"


def _places(task: Task, seed: int) -> FloatArray:
    """(steps, 4, 4) where the waypoints are in a new scene."""
    world = make_scene(task, 0, 0, seed)
    return np.stack([waypoint.target(world) for waypoint in task.waypoints(world)])


def _scenes(task: Task, seeds: Sequence[int]) -> Iterator[str]:
    counts: dict[int, int] = {}
    failures = []
    for number, seed in enumerate(seeds):
        variation = number % task.variations
        where = f"seed {seed}, variation {variation}"
        try:
            world = make_scene(task, variation, seed, seed)
        except NoRoom as error:
            failures.append(f"{where}: {error}")
            continue
        yield from (f"{where}: {problem}" for problem in _untouched(task, world))
        steps = len(task.waypoints(world))
        if counts.setdefault(variation, steps) != steps:
            yield f"{where}: {steps} waypoints, {counts[variation]} in another scene: give always as many"
        failures += [f"{where}: {problem}" for problem in _expert(task, world)]
    if 2 * len(failures) > len(seeds):
        yield "the expert fails in most scenes: " + "; ".join(failures)


def _untouched(task: Task, world: World) -> Iterator[str]:
    if pair := overlaps(world):
        yield f"{pair[0]} and {pair[1]} are inside each other: place them apart"
    waypoints = task.waypoints(world)
    if not waypoints:
        yield "there are no waypoints: the expert needs one at least"
    for frame in {waypoint.frame for waypoint in waypoints} - _seen(world):
        yield f"a waypoint hangs on {frame}, which no camera sees: give it in the frame of what is acted on"
    state = world.save_state()
    done = task.success(world)
    world.step(_AT_REST)
    task.watch(world)
    if done or task.success(world):
        yield "untouched it is a success: success has to ask for what only the steps bring about"
    world.restore_state(state)


def _seen(world: World) -> set[str]:
    """Names of the bodies that belong to something that is drawn and is not the table."""
    model = world.model
    drawn = (model.geom_group < 3) & (model.geom_rgba[:, 3] > 0)
    shown = set(world.instances[model.geom_bodyid[drawn]].tolist())
    unmoving = {int(world.instances[model.body(name).id]) for name in _UNMOVING}
    robot = {int(world.instances[body]) for body in world.robot_bodies}
    things = shown - unmoving - robot
    return {model.body(i).name for i in range(model.nbody) if int(world.instances[i]) in things}


def _expert(task: Task, world: World) -> Iterator[str]:
    try:
        perform(task, world)
    except (ExpertFailed, PlanFailed) as error:
        yield str(error)
