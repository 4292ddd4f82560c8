"""Whether a task is fit to learn and to measure with, in the manner of Gymnasium's `check_env`."""

from collections.abc import Iterator, Sequence

import numpy as np

from imop.errors import InvalidInput, PlanFailed
from imop.geometry import se3
from imop.sim.world import World
from imop.tasks.checks import overlaps
from imop.tasks.env import make_task
from imop.tasks.expert import ExpertFailed, perform
from imop.tasks.layout import NoRoom
from imop.tasks.task import Task, make_scene
from imop.types import Demonstration, FloatArray

SEEDS = (0, 1, 2)
_WAIT = 250
"""Steps of the simulation, half a second."""
_DRIFT, _TILT = 0.003, 0.05
"""What stays moves by less, metres and radians."""
_SAME = 1e-3
"""Poses that differ by less are not drawn at random, metres."""
_UNMOVING = ("world", "table")


def check_task(task: str | type[Task], seeds: Sequence[int] = SEEDS) -> list[str]:
    """What is wrong with a task, and how to mend it; empty if nothing was found.

    Tries one scene a seed, with the variations in turn: the untouched scene is sound and no success, the
    expert succeeds in most scenes, waypoints depend on what cameras see, and scenes on their seeds alone.

    Args:
        task: its name as for `make_task`, or the class.
        seeds: of scenes and objects; twice as many as variations try each of these in two scenes.

    Raises:
        InvalidInput: if there is no such task, or not two seeds.
        AssetMissing, MissingExtra: if it needs what is not there.
    """
    if len(set(seeds)) < 2 or min(seeds) < 0:
        raise InvalidInput("seeds", f"{list(seeds)}", "two different whole numbers from 0 on, at least")
    made = make_task(task) if isinstance(task, str) else task()
    made.name = made.name or type(made).__name__
    if made.variations < 1:
        return [f"variations is {made.variations}: there has to be one at least"]
    return [*_words(made), *_repeatable(made, *sorted(set(seeds))[:2]), *_scenes(made, seeds)]


def _words(task: Task) -> Iterator[str]:
    words = [tuple(task.instructions(variation)) for variation in range(task.variations)]
    for variation, texts in enumerate(words):
        if not texts or not all(isinstance(text, str) and text for text in texts):
            yield f"instructions({variation}) is {texts}: return a tuple of sentences, the usual one first"
    if len(set(words)) < len(words):
        yield "instructions are the same for several variations: say what each of them aims at"


def _repeatable(task: Task, seed: int, other: int) -> Iterator[str]:
    """Whether scenes with the same objects differ as their seeds do."""
    try:
        (first, aims), (again, _), (_, elsewhere) = (_scene(task, seed, s) for s in (seed, seed, other))
    except NoRoom as error:
        yield f"no scene was found for seed {seed} or {other} ({error}): ask for less room, or reach nearer"
        return
    if not np.array_equal(first, again):
        yield f"two scenes of seed {seed} differ: draw everything from the generators of build and reset"
    if len(aims) != len(elsewhere):
        yield f"{len(aims)} waypoints for seed {seed}, {len(elsewhere)} for {other}: give always as many"
    elif np.allclose(aims, elsewhere, atol=_SAME):
        yield f"waypoints are where they were, seed {seed} or {other}: place things at random in reset"


def _scene(task: Task, instance: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """(bodies, 7) where everything is, and (waypoints, 4, 4) where the expert goes."""
    world = make_scene(task, 0, instance, seed)
    places = np.concatenate([world.data.xpos, world.data.xquat], axis=1)
    return places, np.array([waypoint.target(world) for waypoint in task.waypoints(world)])


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
        try:
            demonstration = perform(task, world)
        except (ExpertFailed, PlanFailed) as error:
            failures.append(f"{where}: {error}")
        else:
            yield from (f"{where}: {problem}" for problem in _unseen(world, demonstration))
    if 2 * len(failures) > len(seeds):
        yield "the expert fails in most scenes: " + "; ".join(failures)


def _untouched(task: Task, world: World) -> Iterator[str]:
    if pair := overlaps(world):
        yield f"{pair[0]} and {pair[1]} are inside each other: place them apart"
    if not task.waypoints(world):
        yield "there are no waypoints: the expert needs one at least"
    state, names = world.save_state(), _things(world)
    before = {name: world.pose(name) for name in names}
    done = task.success(world)
    world.step(_WAIT)
    task.watch(world)
    if done or task.success(world):
        yield "untouched it is a success: success has to ask for what only the steps bring about"
    if moved := [name for name in names if not se3.near(world.pose(name), before[name], _DRIFT, _TILT)]:
        yield f"{', '.join(moved)} moved untouched: place things where they stay, or let them settle in reset"
    world.restore_state(state)


def _things(world: World) -> list[str]:
    """Names of the bodies that a task or the clutter added."""
    fixed = {int(world.instances[world.model.body(name).id]) for name in _UNMOVING}
    fixed |= {int(world.instances[body]) for body in world.robot_bodies}
    return [world.model.body(i).name for i, number in enumerate(world.instances) if int(number) not in fixed]


def _unseen(world: World, demonstration: Demonstration) -> Iterator[str]:
    """What a policy cannot follow: steps that hang on nothing that a camera has seen by then."""
    seen: set[int] = set()
    things = set(_things(world))
    for step, keyframe in enumerate(demonstration.keyframes):
        for view in keyframe.observation.views.values():
            if view.instance_ids is not None:
                seen |= set(np.unique(view.instance_ids).tolist())
        frame = keyframe.object_name
        if frame not in things or int(world.instances[world.model.body(frame).id]) not in seen:
            yield f"waypoint {step} hangs on {frame}, which no camera sees: use the frame of what is acted on"
