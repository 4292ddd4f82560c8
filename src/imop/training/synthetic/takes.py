"""Pairs of two takes of a procedural scene, with the truth that only its maker knows."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from imop.geometry import se3
from imop.geometry.cloud import PointCloud
from imop.sim.depth_noise import DepthNoise
from imop.training.data.executed import ExecutedStep
from imop.training.data.pairs import StepPair, next_carry
from imop.training.synthetic.families.thing import Thing, revolution
from imop.training.synthetic.scenes import ProceduralScene, demonstrate
from imop.training.synthetic.stage import State
from imop.types import Action, FloatArray, Observation

_SAME_PLACE, _SAME_TURN = 0.002, np.radians(1.0)
_FEWEST_REGION, _FEWEST_QUERY = 12, 10

Poses = dict[tuple[int, str], FloatArray]


@dataclass(frozen=True, eq=False)
class ProceduralTake:
    """One demonstration of a scene's script.

    Attributes:
        states: before the first step, and after each.
        observations: what was seen in each state.
        clouds: the same as training stores it, with instance ids.
        poses: the links in each state.
    """

    states: tuple[State, ...]
    observations: tuple[Observation, ...]
    clouds: tuple[PointCloud, ...]
    poses: tuple[Poses, ...]

    @property
    def actions(self) -> list[Action]:
        """What was done in each step."""
        return [Action(state.T_world_gripper, state.gripper_open) for state in self.states[1:]]


@dataclass(frozen=True, eq=False)
class SyntheticStep(ExecutedStep[ProceduralTake]):
    """The same of procedural takes.

    Attributes:
        scene: of the query.
    """

    scene: ProceduralScene

    def right_poses(self) -> FloatArray:
        """(S, 4, 4) where the gripper may go in the query; every 2 degrees around a surface of revolution."""
        goals = super().right_poses()
        thing, link = reference(self.scene, self.step)
        if link != "body" or not is_round(self.scene.stage.things[thing]):
            return goals
        T_world_thing = self.asked.poses[self.step][thing, link]
        turned = T_world_thing @ revolution(180) @ se3.invert(T_world_thing)
        return (turned[:, None] @ goals).reshape(-1, 4, 4)


def take(scene: ProceduralScene, rng: np.random.Generator) -> ProceduralTake:
    """Demonstrate and look.

    Raises:
        Unreachable: if the arm cannot do it.
    """
    states = demonstrate(scene, rng)
    noise = DepthNoise.sample(rng)
    observations = tuple(scene.stage.observe(state, noise, rng) for state in states)
    clouds = tuple(scene.stage.stored(observation) for observation in observations)
    return ProceduralTake(
        tuple(states), observations, clouds, tuple(scene.stage.link_poses(state) for state in states)
    )


def make_pair(
    scene: ProceduralScene, support: ProceduralTake, query: ProceduralTake, step: int
) -> SyntheticStep | None:
    """The pair of a step in two takes; None if it is loose or too little of what matters is seen."""
    if scene.script.steps[step].loose:
        return None
    before, now = support.poses[step], query.poses[step]
    members = rigid_with(reference(scene, step), before, now)
    pair = seen_pair((scene, support), (scene, query), step, members, before)
    return None if pair is None else SyntheticStep(pair, support, query, step, scene)


def seen_pair(
    shown: tuple[ProceduralScene, ProceduralTake],
    asked: tuple[ProceduralScene, ProceduralTake],
    step: int,
    members: list[tuple[int, str]],
    before: Poses,
) -> StepPair | None:
    """The pair of a step; None if one of the takes does not see enough of what matters.

    Args:
        shown: the demonstration.
        asked: the execution that the query is of.
        step: its number.
        members: the links of the region.
        before: where the links of the *query's* things would be for the action of the demonstration.
    """
    (shown_scene, support), (asked_scene, query) = shown, asked
    motions = right_motions(asked_scene, reference(shown_scene, step), members, before, query.poses[step])
    ids, seen = support.clouds[step].ids, query.clouds[step].ids
    assert ids is not None and seen is not None
    region = np.isin(ids, instances(shown_scene, members))
    in_query = np.isin(seen, instances(asked_scene, members))
    if region.sum() < _FEWEST_REGION or in_query.sum() < _FEWEST_QUERY:
        return None
    opened = [state.gripper_open for state in support.states[:-1]]
    return StepPair(
        support.clouds[step],
        support.clouds[step + 1],
        query.clouds[step],
        region,
        support.states[step + 1].T_world_gripper @ shown_scene.script.steps[step].T_reached_recorded,
        support.states[step].T_world_gripper,
        (support.states[step].gripper_open, support.states[step + 1].gripper_open),
        motions,
        carry=next_carry(opened, [state.T_world_gripper for state in support.states], support.clouds, step),
    )


def reference(scene: ProceduralScene, step: int) -> tuple[int, str]:
    """Thing and link that a step is fixed to."""
    action = scene.script.steps[step]
    return action.thing, action.link


def instances(scene: ProceduralScene, members: list[tuple[int, str]]) -> NDArray[np.int32]:
    """Instance ids of links."""
    return np.array([scene.stage.links[thing][link] for thing, link in members], dtype=np.int32)


def rigid_with(fixed_to: tuple[int, str], before: Poses, now: Poses) -> list[tuple[int, str]]:
    """The links that stand to a link in one state as they do in another: the paper's I(s), with its ties."""
    M = now[fixed_to] @ se3.invert(before[fixed_to])
    return [link for link, T in before.items() if _same(now[link], M @ T)]


def right_motions(
    scene: ProceduralScene,
    fixed_to: tuple[int, str],
    members: list[tuple[int, str]],
    before: Poses,
    now: Poses,
) -> FloatArray:
    """(S, 4, 4) motions that carry every member onto itself or onto an equal thing, the plain one first."""
    thing, link = fixed_to
    found = []
    for twin in _twins(scene, thing):
        for turn in _turns(scene, thing, link):
            M = now[twin, link] @ turn @ se3.invert(before[fixed_to])
            if all(_covered(scene, member, M @ before[member], now) for member in members):
                found.append(M)
    return np.stack(found)


def _covered(scene: ProceduralScene, member: tuple[int, str], T: FloatArray, now: Poses) -> bool:
    """Whether a link or one like it looks as if it stood at `T`."""
    thing, link = member
    rounded = link == "body" and is_round(scene.stage.things[thing])
    return any(
        _same(now[twin, link] @ turn, T, rounded)
        for twin in _twins(scene, thing)
        for turn in _turns(scene, thing, link)
    )


def _twins(scene: ProceduralScene, thing: int) -> list[int]:
    """The thing, and then those that are equal to it."""
    equal = [i for i, kind in enumerate(scene.kinds) if kind == scene.kinds[thing] and i != thing]
    return [thing, *equal]


def _turns(scene: ProceduralScene, thing: int, link: str) -> FloatArray:
    return scene.stage.things[thing].symmetry if link == "body" else np.eye(4)[None]


def is_round(thing: Thing) -> bool:
    """Whether it is a surface of revolution."""
    return thing.symmetry.shape == revolution().shape and bool(np.allclose(thing.symmetry, revolution()))


def _same(A: FloatArray, B: FloatArray, rounded: bool = False) -> bool:
    """Whether two poses agree; of what is `rounded` only the z axis counts."""
    if se3.translation_distance(A, B) > _SAME_PLACE:
        return False
    if rounded:
        return bool(A[:3, 2] @ B[:3, 2] > np.cos(_SAME_TURN))
    return bool(se3.rotation_distance(A, B) < _SAME_TURN)
