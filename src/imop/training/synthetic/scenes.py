"""Scenes of procedural things, with something to do in them, demonstrated several times."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from imop.geometry import se3
from imop.robots.panda import PANDA_HOME_Q
from imop.sim.cameras import Camera
from imop.training.synthetic import goals, steps
from imop.training.synthetic.families.thing import Family
from imop.training.synthetic.plans import Part, Plan, draw_plan
from imop.training.synthetic.stage import Stage, State, Unreachable, above_table
from imop.training.synthetic.steps import Script
from imop.training.synthetic.viewpoints import placed_cameras
from imop.types import BoolArray, FloatArray

_LOWER, _UPPER, _CELL = np.array((-0.16, -0.48)), np.array((0.62, 0.48)), 0.012
_AREA = ((-0.02, 0.46), (-0.38, 0.38))
_AWAY = se3.make(p=(3.0, 0.0, -5.0))
_TRIES = 12
_COMMANDED = 0.5
"""How often the recorded action is what was commanded, not what was reached."""


@dataclass(frozen=True, eq=False)
class ProceduralScene:
    """Compiled things and what is done with them.

    Attributes:
        stage: the things.
        kinds: (things,) equal numbers are indistinguishable things.
        script: the steps.
        families: (things,) names.
    """

    stage: Stage
    kinds: tuple[int, ...]
    script: Script
    families: tuple[str, ...] = ()


def build(plan: Plan, cameras: Mapping[str, Camera], rng: np.random.Generator) -> ProceduralScene:
    """Compile a plan; how exactly things are done is drawn from `rng`."""
    stage = Stage(plan.things, cameras)
    scripts = [_script(stage, part, rng) for part in plan.parts]
    script = scripts[0]
    for other in scripts[1:]:
        script = script.then(other)
    if rng.random() < _COMMANDED:
        script = replace(script, steps=tuple(_commanded(step, rng) for step in script.steps))
    kinds = tuple(plan.draws.index(draw) for draw in plan.draws)
    return ProceduralScene(stage, kinds, script, tuple(draw.family for draw in plan.draws))


def draw_scene(
    families: Mapping[str, Family],
    rng: np.random.Generator,
    parts_odds: tuple[float, ...] = (0.65, 0.35),
    kinds: Sequence[str] = (),
) -> ProceduralScene:
    """A scene of what `draw_plan` draws.

    Raises:
        Unreachable: if no family can play a part that was drawn.
    """
    plan = draw_plan(families, rng, parts_odds, kinds)
    return build(plan, placed_cameras(rng.spawn(1)[0]), rng)


def _commanded(step: steps.PseudoStep, rng: np.random.Generator) -> steps.PseudoStep:
    """The step with a recorded pose that the gripper missed by up to some millimetres."""
    off = se3.make(se3.euler(*rng.normal(0, 0.012, 3)), rng.normal(0, 0.002, 3))
    return replace(step, T_reached_recorded=off)


def _script(stage: Stage, part: Part, rng: np.random.Generator) -> Script:
    kind, *numbers = part
    first, second, third = (*numbers, -1, -1)[:3]
    if kind in ("carry", "sink"):
        below = None if third < 0 else third
        return steps.carry(stage, first, second, rng, below, into_hole=kind == "sink")
    if kind == "use":
        return steps.use(stage, first, second, rng)
    if kind in ("operate", "row"):
        moving = stage.things[first].moving
        return steps.operate(stage, first, moving[int(rng.integers(len(moving)))], rng)
    if kind == "keep":
        return goals.keep(stage, first, second, rng)
    if kind == "unpack":
        return goals.unpack(stage, first, second, third, tuple(numbers[3:]), rng)
    if kind == "shove":
        return goals.shove(stage, first, second, rng)
    return steps.press(stage, first, rng) if kind == "press" else steps.push(stage, first, rng)


def demonstrate(scene: ProceduralScene, rng: np.random.Generator) -> list[State]:
    """The states of one execution of the scene's script, things placed at random: one more than steps.

    Raises:
        Unreachable: if no arrangement was found in which the arm can do it.
    """
    for _ in range(_TRIES):
        try:
            states = [_arrange(scene, rng)]
            for step in scene.script.steps:
                states.append(steps.perform(scene.stage, states[-1], step.drawn(rng)))
        except Unreachable:
            continue
        return states
    raise Unreachable(f"no arrangement in {_TRIES} tries lets the arm do it")


def _arrange(scene: ProceduralScene, rng: np.random.Generator) -> State:
    stage, script = scene.stage, scene.script
    free = np.ones(np.ceil((_UPPER - _LOWER) / _CELL).astype(int), dtype=bool)
    poses = np.stack([_AWAY] * len(stage.things))
    needed = set(script.rests) | {below for below, _ in script.resting_on.values()}
    elsewhere = {*script.resting_on, *script.lying, *script.before}
    needed |= {before.goal for before in script.before.values()}
    order = sorted(range(len(stage.things)), key=lambda i: (i not in needed, i in script.before))
    for i in order:
        if i in script.before:
            poses[i] = _before(stage, i, script.before[i], poses, free, rng)
        if i in elsewhere:
            continue
        if i in needed or rng.random() < 0.9:
            R = script.rests.get(i, np.eye(3))
            poses[i] = _place(stage, i, R, free, rng)
            if i in needed and poses[i, 2, 3] < 0:
                raise Unreachable("no free place on the table")
    for i, (below, T_below_thing) in script.resting_on.items():
        poses[i] = poses[below] @ T_below_thing
    placed: list[FloatArray] = []
    for i, lying in script.lying.items():
        poses[i] = poses[lying.below] @ _lies(stage, i, lying, placed, rng)
    joints = {}
    for i, thing in enumerate(stage.things):
        for moving in thing.moving:
            low, high = moving.positions
            ajar = rng.random() < 0.15
            joints[i, moving.joint] = rng.uniform(min(low, high), max(low, high)) if ajar else low
        if thing.bends:
            angles = _bend(len(thing.bends), rng)
            joints |= {(i, hinge): float(a) for hinge, a in zip(thing.bends, angles, strict=True)}
    joints |= script.joints
    start = se3.make(p=rng.uniform(-0.08, 0.08, 3)) @ stage.home @ se3.make(se3.euler(z=rng.normal(0, 0.2)))
    first = script.steps[0]
    state = State(poses, joints, gripper_open=first.gripper_open, opening=float(first.gripper_open))
    return State(poses, joints, start, state.opening, state.gripper_open, _near_home(start))


def _bend(hinges: int, rng: np.random.Generator) -> FloatArray:
    """(hinges,) angles of a smooth curve that winds to both sides, radians."""
    swing, turns, phase = rng.uniform(0.05, 0.45), rng.uniform(0.5, 1.5), rng.uniform(-np.pi, np.pi)
    return np.asarray(swing * np.sin(turns * np.linspace(0, 2 * np.pi, hinges) + phase))


def _near_home(T_world_gripper: FloatArray) -> FloatArray:
    return State(np.zeros((0, 4, 4)), q=PANDA_HOME_Q).reached(T_world_gripper).q


def _place(stage: Stage, thing: int, R: FloatArray, free: BoolArray, rng: np.random.Generator) -> FloatArray:
    """A pose on free ground, which it takes; or far away if none is found."""
    facing = bool(stage.things[thing].moving) and rng.random() < 0.8
    for _ in range(30):
        yaw = rng.uniform(np.pi - 1.2, np.pi + 1.2) if facing else rng.uniform(-np.pi, np.pi)
        turned = se3.euler(z=yaw) @ R
        at = np.array([rng.uniform(*side) for side in _AREA])
        if _claimed(stage, thing, turned, at, free):
            return above_table(turned, float(at[0]), float(at[1]), stage.footprint(thing, turned)[1])
    return _AWAY


def _claimed(stage: Stage, thing: int, R: FloatArray, at: FloatArray, free: BoolArray) -> bool:
    """Whether the thing, turned by `R` (3, 3), has free ground at `at` (2,), which it then takes."""
    xy, _ = stage.footprint(thing, R)
    cells = np.floor((xy + at - _LOWER) / _CELL).astype(int)
    if (cells < 1).any() or (cells >= np.array(free.shape) - 1).any():
        return False
    if not free[cells[:, 0], cells[:, 1]].all():
        return False
    for dx in (-1, 0, 1):
        for dy in (-1, 0, 1):
            free[cells[:, 0] + dx, cells[:, 1] + dy] = False
    return True


def _before(
    stage: Stage,
    thing: int,
    before: steps.Before,
    poses: FloatArray,
    free: BoolArray,
    rng: np.random.Generator,
) -> FloatArray:
    """A pose on free ground somewhere before the thing's goal, turned and shifted a little."""
    T_world_end = poses[before.goal] @ before.T_goal_thing
    way = poses[before.goal][:2, :2] @ before.way
    for _ in range(40):
        far = rng.uniform(0.07, 0.3)
        aside = rng.uniform(-0.35, 0.35) * far
        at = T_world_end[:2, 3] - far * way + aside * np.array([-way[1], way[0]])
        turned = se3.euler(z=rng.uniform(-0.6, 0.6)) @ T_world_end[:3, :3]
        if (
            _AREA[0][0] < at[0] < _AREA[0][1]
            and _AREA[1][0] < at[1] < _AREA[1][1]
            and _claimed(stage, thing, turned, at, free)
        ):
            return above_table(turned, float(at[0]), float(at[1]), stage.footprint(thing, turned)[1])
    raise Unreachable("no free place before the goal")


def _lies(
    stage: Stage, thing: int, lying: steps.Lying, placed: list[FloatArray], rng: np.random.Generator
) -> FloatArray:
    """T_below_thing (4, 4) anywhere on a floor, beside what is `placed` there: cells (N, 2) of that body."""
    floor = stage.things[lying.below].floors[lying.floor]
    for _ in range(15):
        R = se3.euler(z=rng.uniform(-np.pi, np.pi))
        xy, depth = stage.footprint(thing, R)
        low, high = -np.array(floor.half) - xy.min(axis=0), np.array(floor.half) - xy.max(axis=0)
        if (low > high).any():
            continue
        T = se3.make(R, floor.middle + np.array([*rng.uniform(low, high), depth]))
        taken = np.unique(np.round((xy + T[:2, 3]) / _CELL), axis=0)
        if all(np.abs(taken[:, None] - other).max(axis=2).min() > 1 for other in placed):
            placed.append(taken)
            return T
    raise Unreachable("no room on the floor")
