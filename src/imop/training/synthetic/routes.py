"""Routes from procedural scenes: a demonstration, and states of another execution of the same task."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from imop.geometry import se3
from imop.networks.changes import COMPARED
from imop.sim.depth_noise import DepthNoise
from imop.training.data.route import Query, Route, SeenState
from imop.training.synthetic.families.thing import Family
from imop.training.synthetic.mishaps import Mishap, mishaps
from imop.training.synthetic.scenes import ProceduralScene, demonstrate, draw_scene
from imop.training.synthetic.stage import State, Unreachable
from imop.training.synthetic.takes import Poses
from imop.types import BoolArray, FloatArray

IMAGE = 64
PARTS_ODDS = (0.35, 0.4, 0.25)
MISHAPS = 4
_SAME_PLACE, _SAME_TURN, _SAME_OPENING = 0.005, np.radians(3.0), 0.05


@dataclass(frozen=True, eq=False)
class _Execution:
    """One execution of a script, as it was seen, with what went wrong in others like it."""

    states: list[State]
    poses: list[Poses]
    seen: tuple[SeenState, ...]
    asked: tuple[tuple[SeenState, Mishap], ...]


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


def _execute(scene: ProceduralScene, rng: np.random.Generator) -> _Execution:
    states = demonstrate(scene, rng)
    noise = DepthNoise.sample(rng)

    def look(state: State) -> SeenState:
        cloud = scene.stage.cloud(state, noise, rng, COMPARED, IMAGE)
        return SeenState(cloud, state.T_world_gripper, state.opening)

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


def _before(tried: _Execution, seen: SeenState, wrong: Mishap) -> SeenState:
    """What was seen before the last action: things as they were then, the gripper a step before."""
    last = wrong.expected - 1
    if last < 0:
        return seen
    things, gripper = tried.seen[wrong.before], tried.seen[last]
    # What went wrong earlier left the hand empty since.
    opening = 0.0 if last > wrong.before and not tried.states[last].gripper_open else gripper.opening
    return SeenState(things.cloud, gripper.T_world_gripper, opening)


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
