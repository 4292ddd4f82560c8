"""Random scenes of procedural things, with something to do in them, demonstrated several times."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from imop.geometry import se3
from imop.sim.cameras import Camera
from imop.sim.robot import PANDA_HOME_Q
from imop.training import steps
from imop.training.families.redraw import redrawn
from imop.training.families.thing import Family, Thing
from imop.training.stage import Stage, State, Unreachable, above_table
from imop.training.steps import Recipe
from imop.training.viewpoints import placed_cameras
from imop.types import BoolArray, FloatArray

MOST_THINGS = 8
_LOWER, _UPPER, _CELL = np.array((-0.16, -0.48)), np.array((0.62, 0.48)), 0.012
_AREA = ((-0.02, 0.46), (-0.38, 0.38))
_AWAY = se3.make(p=(3.0, 0.0, -5.0))
_TRIES = 12


@dataclass(frozen=True, eq=False)
class Scene:
    """Compiled things and what is done with them.

    Attributes:
        stage: the things.
        kinds: (things,) equal numbers are indistinguishable things.
        recipe: the steps.
        families: (things,) names.
    """

    stage: Stage
    kinds: tuple[int, ...]
    recipe: Recipe
    families: tuple[str, ...] = ()


class Draw(NamedTuple):
    """How a thing was drawn: equal draws are indistinguishable things.

    Attributes:
        family: its name.
        shape, color: seeds.
        sizes: seed of other sizes for that shape, or None.
    """

    family: str
    shape: int
    color: int
    sizes: int | None = None

    def thing(self, families: Mapping[str, Family]) -> Thing:
        """Draw it again.

        Raises:
            Diverged: if the shape has no other sizes.
        """
        family = families[self.family]
        if self.sizes is None:
            return family(np.random.default_rng(self.shape), np.random.default_rng(self.color))
        return redrawn(family, self.shape, self.color, self.sizes)


Part = tuple[str, int, int, int]
"""What is done, with which things; -1 for none."""


@dataclass(frozen=True, eq=False)
class Plan:
    """What a scene is made of, before it is compiled.

    Attributes:
        draws: of all things; those that something is done with come first.
        things: the same, drawn.
        parts: what is done.
    """

    draws: tuple[Draw, ...]
    things: tuple[Thing, ...]
    parts: tuple[Part, ...]

    @property
    def acting(self) -> int:
        """The number of things that something is done with."""
        return 1 + max(number for part in self.parts for number in part[1:])


class _Cast:
    """Draws things and remembers how, so that they can be drawn again in another shape or colour."""

    def __init__(self, families: Mapping[str, Family], rng: np.random.Generator):
        self.families, self.rng = families, rng
        self.things: list[Thing] = []
        self.draws: list[Draw] = []

    def add(self, name: str | None = None, shape: int | None = None, color: int | None = None) -> int:
        """Add one of a family; what is not given is random. Returns its number."""
        name = str(self.rng.choice(list(self.families))) if name is None else name
        drawn = self.rng.integers(2**32, size=2).tolist()
        draw = Draw(name, drawn[0] if shape is None else shape, drawn[1] if color is None else color)
        self.things.append(draw.thing(self.families))
        self.draws.append(draw)
        return len(self.things) - 1

    def where(self, wanted: str) -> int:
        """Add a random thing that has some of the attribute `wanted`."""
        for _ in range(200):
            number = self.add()
            offered = getattr(self.things[number], wanted)
            if offered is not None and len(offered):
                return number
            self.things.pop()
            self.draws.pop()
        raise Unreachable(f"no family has {wanted}")

    def distract(self, number: int) -> None:
        """Add things that resemble one."""
        name, shape, color, _ = self.draws[number]
        if self.rng.random() < 0.4:
            self.add(name, shape=shape)
        if self.rng.random() < 0.25:
            self.add(None if self.rng.random() < 0.5 else name, color=color)
        if self.rng.random() < 0.2:
            self.add(name, shape, color)


def draw_plan(
    families: Mapping[str, Family], rng: np.random.Generator, parts_odds: tuple[float, ...] = (0.65, 0.35)
) -> Plan:
    """Things, and one thing to do, or two, or as many as `parts_odds` has chances for.

    Raises:
        Unreachable: if no family can play a part that was drawn.
    """
    cast = _Cast(families, rng)
    parts: list[Part] = []
    for _ in range(int(rng.choice(1 + np.arange(len(parts_odds)), p=parts_odds))):
        kind = str(rng.choice(("carry", "use", "operate", "press", "push"), p=(0.45, 0.12, 0.27, 0.06, 0.1)))
        if kind == "carry":
            below = cast.where("spots") if rng.random() < 0.15 else -1
            parts.append((kind, cast.where("holds"), cast.where("spots"), below))
        elif kind == "use":
            parts.append((kind, cast.where("tool"), cast.add(), -1))
        elif kind == "operate":
            parts.append((kind, cast.where("moving"), -1, -1))
        else:
            parts.append((kind, cast.where("holds"), -1, -1))
    acting = len(cast.things)
    for number in range(acting):
        cast.distract(number)
    for _ in range(int(rng.integers(1, 4))):
        cast.add()
    for items in (cast.things, cast.draws):
        del items[max(MOST_THINGS, acting) :]
    return Plan(tuple(cast.draws), tuple(cast.things), tuple(parts))


def build(plan: Plan, cameras: Mapping[str, Camera], rng: np.random.Generator) -> Scene:
    """Compile a plan; how exactly things are done is drawn from `rng`."""
    stage = Stage(plan.things, cameras)
    recipes = [_recipe(stage, part, rng) for part in plan.parts]
    recipe = recipes[0]
    for other in recipes[1:]:
        recipe = recipe.then(other)
    kinds = tuple(plan.draws.index(draw) for draw in plan.draws)
    return Scene(stage, kinds, recipe, tuple(draw.family for draw in plan.draws))


def draw_scene(
    families: Mapping[str, Family], rng: np.random.Generator, parts_odds: tuple[float, ...] = (0.65, 0.35)
) -> Scene:
    """A scene of what `draw_plan` draws.

    Raises:
        Unreachable: if no family can play a part that was drawn.
    """
    plan = draw_plan(families, rng, parts_odds)
    return build(plan, placed_cameras(rng.spawn(1)[0]), rng)


def _recipe(stage: Stage, part: Part, rng: np.random.Generator) -> Recipe:
    kind, first, second, below = part
    if kind == "carry":
        return steps.carry(stage, first, second, rng, None if below < 0 else below)
    if kind == "use":
        return steps.use(stage, first, second, rng)
    if kind == "operate":
        moving = stage.things[first].moving
        return steps.operate(stage, first, moving[int(rng.integers(len(moving)))], rng)
    return steps.press(stage, first, rng) if kind == "press" else steps.push(stage, first, rng)


def demonstrate(scene: Scene, rng: np.random.Generator) -> list[State]:
    """The states of one execution of the scene's recipe, things placed at random: one more than steps.

    Raises:
        Unreachable: if no arrangement was found in which the arm can do it.
    """
    for _ in range(_TRIES):
        try:
            states = [_arrange(scene, rng)]
            for step in scene.recipe.steps:
                states.append(steps.perform(scene.stage, states[-1], step))
        except Unreachable:
            continue
        return states
    raise Unreachable(f"no arrangement in {_TRIES} tries lets the arm do it")


def _arrange(scene: Scene, rng: np.random.Generator) -> State:
    stage, recipe = scene.stage, scene.recipe
    free = np.ones(np.ceil((_UPPER - _LOWER) / _CELL).astype(int), dtype=bool)
    poses = np.stack([_AWAY] * len(stage.things))
    needed = set(recipe.rests) | {below for below, _ in recipe.resting_on.values()}
    for i in sorted(range(len(stage.things)), key=lambda i: i not in needed):
        if i in recipe.resting_on:
            continue
        if i in needed or rng.random() < 0.9:
            R = recipe.rests.get(i, np.eye(3))
            poses[i] = _place(stage, i, R, free, rng)
            if i in needed and poses[i, 2, 3] < 0:
                raise Unreachable("no free place on the table")
    for i, (below, T_below_thing) in recipe.resting_on.items():
        poses[i] = poses[below] @ T_below_thing
    joints = {}
    for i, thing in enumerate(stage.things):
        for moving in thing.moving:
            low, high = moving.positions
            ajar = rng.random() < 0.15
            joints[i, moving.joint] = rng.uniform(min(low, high), max(low, high)) if ajar else low
        if thing.bends:
            angles = _bend(len(thing.bends), rng)
            joints |= {(i, hinge): float(a) for hinge, a in zip(thing.bends, angles, strict=True)}
    joints |= recipe.joints
    start = se3.make(p=rng.uniform(-0.08, 0.08, 3)) @ stage.home @ se3.make(se3.euler(z=rng.normal(0, 0.2)))
    first = recipe.steps[0]
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
        xy, depth = stage.footprint(thing, turned)
        at = np.array([rng.uniform(*side) for side in _AREA])
        cells = np.floor((xy + at - _LOWER) / _CELL).astype(int)
        if (cells < 1).any() or (cells >= np.array(free.shape) - 1).any():
            continue
        if free[cells[:, 0], cells[:, 1]].all():
            for dx in (-1, 0, 1):
                for dy in (-1, 0, 1):
                    free[cells[:, 0] + dx, cells[:, 1] + dy] = False
            return above_table(turned, float(at[0]), float(at[1]), depth)
    return _AWAY
