"""Examples for the routing network: a demonstration, and states of another execution of the same task."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.geometry.cloud import PointCloud
from imop.networks.changes import COMPARED
from imop.sim.depth_noise import DepthNoise
from imop.training.families.thing import Family
from imop.training.mishaps import Mishap, mishaps
from imop.training.scenes import Scene, demonstrate, draw_scene
from imop.training.stage import State, Unreachable
from imop.training.takes import Poses
from imop.types import BoolArray, FloatArray, as_array, as_pose

IMAGE = 64
PARTS_ODDS = (0.35, 0.4, 0.25)
MISHAPS = 4
_SAME_PLACE, _SAME_TURN, _SAME_OPENING = 0.005, np.radians(3.0), 0.05


@dataclass(frozen=True, eq=False)
class Seen:
    """What a robot sees and knows of itself in one state.

    Attributes:
        cloud: without the robot, with normals.
        T_world_gripper: (4, 4).
        opening: of the gripper, 0 closed .. 1 open.
    """

    cloud: PointCloud
    T_world_gripper: FloatArray
    opening: float

    def __post_init__(self) -> None:
        if not len(self.cloud):
            raise InvalidInput("cloud", "empty", "at least one point")
        as_pose("T_world_gripper", self.T_world_gripper)


@dataclass(frozen=True, eq=False)
class Query:
    """A state for which the step is asked.

    Attributes:
        seen: the state.
        before: what was seen before the last action; the state itself at the beginning.
        expected: number of the step that comes next if every action so far did what was demonstrated; the
            number of steps if all are done.
        right: (L,) True for the steps that are right: more than one where demonstrated states are the same.
        kind: the mishap that led to the state (`mishaps.Kind`); "ordinary" if all went as demonstrated.
    """

    seen: Seen
    before: Seen
    expected: int
    right: BoolArray
    kind: str = "ordinary"


@dataclass(frozen=True, eq=False)
class Route:
    """A demonstration and queries to it.

    Attributes:
        states: s_0 .. s_{L-1}, each before its step.
        queries: states of other executions; the one after the last step is among them only if it failed.
    """

    states: tuple[Seen, ...]
    queries: tuple[Query, ...]

    def __post_init__(self) -> None:
        for query in self.queries:
            right = as_array("right", query.right, (len(self.states),), np.bool_)
            if not right.any():
                raise InvalidInput("right", "no step is right", "at least one True")


@dataclass(frozen=True, eq=False)
class _Execution:
    """One execution of a recipe, as it was seen, with what went wrong in others like it."""

    states: list[State]
    poses: list[Poses]
    seen: tuple[Seen, ...]
    asked: tuple[tuple[Seen, Mishap], ...]


def synthetic_routes(seed: int, count: int, families: Mapping[str, Family]) -> Iterator[Route]:
    """`count` routes, the same for the same seed and families; a scene gives two, one in each direction."""
    rng = np.random.default_rng(seed)
    made = 0
    while made < count:
        try:
            scene = draw_scene(families, rng, PARTS_ODDS)
            first, second = (_execute(scene, rng) for _ in range(2))
        except Unreachable:
            continue
        for shown, tried in ((first, second), (second, first)):
            if made < count:
                yield _route(shown, tried)
                made += 1


def _execute(scene: Scene, rng: np.random.Generator) -> _Execution:
    states = demonstrate(scene, rng)
    noise = DepthNoise.sample(rng)

    def look(state: State) -> Seen:
        cloud = scene.stage.cloud(state, noise, rng, COMPARED, IMAGE)
        return Seen(cloud, state.T_world_gripper, state.opening)

    wrong = mishaps(scene, states, rng, MISHAPS)
    return _Execution(
        states[:-1],
        [scene.stage.link_poses(state) for state in states[:-1]],
        tuple(look(state) for state in states[:-1]),
        tuple((look(mishap.state), mishap) for mishap in wrong),
    )


def _route(shown: _Execution, tried: _Execution) -> Route:
    same = indistinguishable(shown.states, shown.poses)
    queries = [Query(seen, tried.seen[max(j - 1, 0)], j, same[j]) for j, seen in enumerate(tried.seen)]
    queries += [
        Query(seen, _before(tried, seen, wrong), wrong.expected, same[wrong.right], wrong.kind)
        for seen, wrong in tried.asked
    ]
    return Route(shown.seen, tuple(queries))


def _before(tried: _Execution, seen: Seen, wrong: Mishap) -> Seen:
    """What was seen before the last action: things as they were then, the gripper a step before."""
    last = wrong.expected - 1
    if last < 0:
        return seen
    things, gripper = tried.seen[wrong.before], tried.seen[last]
    # What went wrong earlier left the hand empty since.
    opening = 0.0 if last > wrong.before and not tried.states[last].gripper_open else gripper.opening
    return Seen(things.cloud, gripper.T_world_gripper, opening)


def indistinguishable(states: list[State], poses: list[Poses]) -> BoolArray:
    """(L, L) True for pairs of states that look the same to cameras and robot; every state does to itself."""
    same = np.eye(len(states), dtype=bool)
    for i in range(len(states)):
        for j in range(i):
            a, b = states[i], states[j]
            robot = abs(a.opening - b.opening) < _SAME_OPENING and _near(a.T_world_gripper, b.T_world_gripper)
            things = all(_near(T, poses[j][link]) for link, T in poses[i].items())
            same[i, j] = same[j, i] = robot and things
    return same


def _near(A: FloatArray, B: FloatArray) -> bool:
    return bool(se3.near(A, B, _SAME_PLACE, _SAME_TURN))
