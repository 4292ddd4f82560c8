"""What goes wrong in an episode: states that no demonstration shows, and the step with which to go on."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np

from imop.geometry import se3
from imop.sim.world import TABLE_HEIGHT
from imop.training.synthetic.scenes import ProceduralScene
from imop.training.synthetic.stage import State, Unreachable, above_table
from imop.types import FloatArray

_HIGH = TABLE_HEIGHT + 0.12

Kind = Literal["missed", "dropped", "fallen", "partial", "slipped", "moved"]
"""Nothing was grasped; it was lost on the way; it did not stay where it was put; a joint moved part of its
way; the gripper left a joint's link; the gripper alone stands elsewhere."""


@dataclass(frozen=True, eq=False)
class Mishap:
    """A state of an episode that does not go as demonstrated.

    Attributes:
        kind: what went wrong.
        state: where everything is.
        before: number of the execution's state that shows the things as they were before the last action.
        expected: number of the step that would come next if all had gone well.
        right: number of the step with which the task can still be done.
    """

    kind: Kind
    state: State
    before: int
    expected: int
    right: int


@dataclass(frozen=True)
class _Possible:
    """A mishap whose state is not made yet."""

    kind: Kind
    make: Callable[[], State]
    before: int
    expected: int
    right: int


def mishaps(
    scene: ProceduralScene, states: Sequence[State], rng: np.random.Generator, count: int
) -> list[Mishap]:
    """Up to `count` different mishaps of one execution of the scene's script, whose states are given."""
    possible = [*_of_carrying(scene, states, rng), *_of_joints(scene, states, rng)]
    chosen = [possible[i] for i in rng.permutation(len(possible))]
    found: list[Mishap] = []
    for one in [_of_gripper(scene, states, rng), *chosen]:
        if len(found) < count:
            try:
                found.append(Mishap(one.kind, one.make(), one.before, one.expected, one.right))
            except Unreachable:
                continue
    return found


def _of_carrying(
    scene: ProceduralScene, states: Sequence[State], rng: np.random.Generator
) -> list[_Possible]:
    """A thing is not taken, lost on the way, or does not stay where it was put: take it anew."""
    found: list[_Possible] = []
    for k, step in enumerate(scene.script.steps):
        if step.take:
            start = _start(scene, k)
            same_part = [j for j in range(k + 1, len(states)) if _start(scene, j - 1) == start]
            for j in same_part:
                args = scene, states, k, j, rng
                if states[j].held == step.thing:
                    found.append(_Possible("missed", partial(_missed, *args), k, j, start))
                    if j > k + 1:
                        found.append(_Possible("dropped", partial(_dropped, *args), j - 1, j, start))
                else:
                    found.append(_Possible("fallen", partial(_fallen, *args), j - 1, j, start))
    return found


def _missed(
    scene: ProceduralScene, states: Sequence[State], k: int, j: int, rng: np.random.Generator
) -> State:
    """The fingers of state j closed on nothing; the thing is about where it was before step k."""
    thing = scene.script.steps[k].thing
    poses = states[j].poses.copy()
    # Right after closing, the gripper beside it is what went wrong; later the thing may have been shoved.
    shove = rng.uniform(-0.02, 0.02, 2) if j > k + 1 else np.zeros(2)
    poses[thing] = se3.make(p=(*shove, 0)) @ states[k].poses[thing]
    empty = replace(states[j], poses=poses, held=None, opening=0.0)
    if j > k + 1:
        return empty
    angle = rng.uniform(-np.pi, np.pi)
    aside = rng.uniform(0.025, 0.05) * np.array([np.cos(angle), np.sin(angle), 0.0])
    aside[2] = rng.uniform(0.0, 0.03)
    return empty.reached(se3.make(p=aside) @ empty.T_world_gripper)


def _dropped(
    scene: ProceduralScene, states: Sequence[State], k: int, j: int, rng: np.random.Generator
) -> State:
    """What was held in state j lies below the gripper, or beside where that is low."""
    thing = scene.script.steps[k].thing
    p = states[j].T_world_gripper[:3, 3]
    reach = (0.0, 0.05) if p[2] > _HIGH else (0.08, 0.14)
    poses = states[j].poses.copy()
    poses[thing] = _lying(scene, thing, p[:2], reach, rng)
    return replace(states[j], poses=poses, held=None, opening=0.0)


def _fallen(
    scene: ProceduralScene, states: Sequence[State], k: int, j: int, rng: np.random.Generator
) -> State:
    """What had been put down before state j lies beside what it was put on."""
    stage, thing = scene.stage, scene.script.steps[k].thing
    poses = states[j].poses.copy()
    size = sum(float(np.abs(stage.footprint(i, np.eye(3))[0]).max()) for i in (thing, _target(scene, k)))
    poses[thing] = _lying(scene, thing, poses[thing][:2, 3], (size + 0.02, size + 0.1), rng)
    return replace(states[j], poses=poses)


def _target(scene: ProceduralScene, k: int) -> int:
    """What the thing taken in step k is put on: the first other thing that a later step is fixed to."""
    steps = scene.script.steps[k:]
    return next((step.thing for step in steps if step.thing != steps[0].thing), steps[0].thing)


def _lying(
    scene: ProceduralScene, thing: int, xy: FloatArray, reach: tuple[float, float], rng: np.random.Generator
) -> FloatArray:
    """T_world_thing (4, 4) on the table, `reach` metres from `xy`, as it lay before, turned anyhow."""
    R = se3.euler(z=rng.uniform(-np.pi, np.pi)) @ scene.script.rests[thing]
    _, depth = scene.stage.footprint(thing, R)
    angle, far = rng.uniform(-np.pi, np.pi), rng.uniform(*reach)
    x, y = xy + far * np.array([np.cos(angle), np.sin(angle)])
    return above_table(R, float(x), float(y), depth)


def _of_joints(scene: ProceduralScene, states: Sequence[State], rng: np.random.Generator) -> list[_Possible]:
    """What was to be pulled, turned or pushed went part of the way: go on, or begin anew if it slipped."""
    found: list[_Possible] = []
    for k, step in enumerate(scene.script.steps):
        if step.joint is not None:
            start = _start(scene, k)
            if states[k - 1].gripper_open and not states[k].gripper_open and k > start:
                found.append(
                    _Possible("missed", partial(_missed, scene, states, k - 1, k, rng), k - 1, k, start)
                )
            found.append(_Possible("partial", partial(_partly, scene, states, k, rng), k, k + 1, k))
            for j in range(k + 1, len(states)):
                if _start(scene, j - 1) == start:
                    make = partial(_slipped, scene, states, k, j, rng)
                    found.append(_Possible("slipped", make, k, j, start))
    return found


def _joint_at(scene: ProceduralScene, states: Sequence[State], k: int, j: int, share: float) -> State:
    """State j with the joint that step k moves after a share of its way."""
    step = scene.script.steps[k]
    assert step.joint is not None
    name = (step.thing, step.joint[0])
    begin, end = (states[i].joints.get(name, 0.0) for i in (k, k + 1))
    return replace(states[j], joints={**states[j].joints, name: begin + share * (end - begin)})


def _partly(scene: ProceduralScene, states: Sequence[State], k: int, rng: np.random.Generator) -> State:
    """The gripper, still on the link, stopped on the way."""
    step = scene.script.steps[k]
    partly = _joint_at(scene, states, k, k, rng.uniform(0.15, 0.6))
    before, now = (scene.stage.link_poses(state)[step.thing, step.link] for state in (states[k], partly))
    return partly.reached(now @ se3.invert(before) @ states[k].T_world_gripper)


def _slipped(
    scene: ProceduralScene, states: Sequence[State], k: int, j: int, rng: np.random.Generator
) -> State:
    """The gripper went on to where it is in state j without the link."""
    left = _joint_at(scene, states, k, j, rng.uniform(0.0, 0.35))
    left = left if left.gripper_open else replace(left, opening=0.0)
    if j == k + 1 and not states[k].gripper_open and states[k].opening == 0.0:
        # A closed finger that pushed would stand inside the link.
        return left.reached(left.T_world_gripper @ se3.make(p=(0, 0, -rng.uniform(0.03, 0.06))))
    return left


def _of_gripper(scene: ProceduralScene, states: Sequence[State], rng: np.random.Generator) -> _Possible:
    """A demonstrated state with the gripper, and what it holds, a little elsewhere; the step is the same."""
    j = int(rng.integers(len(states) - 1))
    free = j in scene.script.starts and states[j].held is None
    far = 0.15 if free else 0.02
    turn = se3.euler(*rng.normal(0, 0.05, 3))
    move = se3.make(p=rng.uniform(-far, far, 3) * (1, 1, 0.5))
    goal = move @ states[j].T_world_gripper @ se3.make(turn)
    return _Possible("moved", partial(states[j].reached, goal), max(j - 1, 0), j, j)


def _start(scene: ProceduralScene, step: int) -> int:
    """The step that begins the part of the script to which a step belongs."""
    return max(start for start in scene.script.starts if start <= step)
