"""Pairs of a step on one thing and the same step on another of its kind."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from imop.geometry import se3
from imop.geometry.neighbours import nearest
from imop.training.data.invariance import distances, has_invariant_part
from imop.training.synthetic.families.thing import Family
from imop.training.synthetic.instances import Variation, other_instances
from imop.training.synthetic.plans import draw_plan
from imop.training.synthetic.scenes import ProceduralScene, build, demonstrate
from imop.training.synthetic.stage import Unreachable
from imop.training.synthetic.surfaces import surface
from imop.training.synthetic.takes import (
    Poses,
    ProceduralTake,
    SyntheticStep,
    reference,
    rigid_with,
    seen_pair,
    take,
)
from imop.training.synthetic.viewpoints import placed_cameras
from imop.types import FloatArray

_BESIDE = 0.01
"""What is measured this far from the thing's surface is noise, metres."""


@dataclass(eq=False)
class _Instance:
    """A scene with one set of things.

    Attributes:
        scene: it.
        take: a demonstration, seen.
        again: the links in each state of another one, which tell what stays together.
    """

    scene: ProceduralScene
    take: ProceduralTake
    again: tuple[Poses, ...]
    _surfaces: dict[int, dict[str, FloatArray]] = field(default_factory=dict)

    def surface(self, thing: int, link: str) -> FloatArray:
        """(N, 3) points of the outside of a link, in its frame."""
        if thing not in self._surfaces:
            self._surfaces[thing] = surface(self.scene.stage, thing)
        return self._surfaces[thing][link]

    def rigid(self, step: int) -> list[tuple[int, str]]:
        """The links that stay where they are, seen from what the step is fixed to."""
        return rigid_with(reference(self.scene, step), self.take.poses[step], self.again[step])

    def goal(self, step: int) -> FloatArray:
        """(4, 4) the action pose of a step."""
        return self.take.states[step + 1].T_world_gripper


def pairs_across(
    families: Mapping[str, Family],
    variation: Variation,
    rng: np.random.Generator,
    kinds: Sequence[str] = (),
) -> list[SyntheticStep]:
    """The pairs of one scene, whose things are others in the query; of some kinds of what is done, or all.

    Raises:
        Unreachable: if what was drawn cannot be done, or has no other things.
    """
    *plans, changed = other_instances(draw_plan(families, rng, kinds=kinds), families, variation, rng)
    cameras, how = placed_cameras(rng.spawn(1)[0]), int(rng.integers(2**32))
    scenes = [build(plan, cameras, np.random.default_rng(how)) for plan in plans]
    if _outline(scenes[0]) != _outline(scenes[1]):
        raise Unreachable("it is done otherwise with the other things")
    one, other = (_instance(scene, rng) for scene in scenes)
    found = []
    for step in range(len(scenes[0].script.steps)):
        if scenes[0].script.steps[step].loose:
            continue
        concerned = {scenes[0].script.steps[step].thing, one.take.states[step].held}
        if concerned & changed:
            found += [_pair(a, b, step, variation != "color") for a, b in ((one, other), (other, one))]
    return [pair for pair in found if pair is not None]


def _outline(scene: ProceduralScene) -> list[tuple[object, ...]]:
    return [
        (s.thing, s.link, s.gripper_open, s.take, s.carry and s.carry[0], s.loose > 0)
        for s in scene.script.steps
    ]


def _instance(scene: ProceduralScene, rng: np.random.Generator) -> _Instance:
    again = tuple(scene.stage.link_poses(state) for state in demonstrate(scene, rng))
    return _Instance(scene, take(scene, rng), again)


def _pair(shown: _Instance, asked: _Instance, step: int, labelled: bool) -> SyntheticStep | None:
    """The pair of a step; None if too little of it is seen, or nothing stays near the action."""
    fixed_to = reference(asked.scene, step)
    both = asked.rigid(step)
    members = [link for link in shown.rigid(step) if link in both]
    now = asked.take.poses[step]
    # Where the query's thing would be if the demonstrated action were the one on it.
    T_world_link = shown.goal(step) @ se3.invert(asked.scene.script.steps[step].T_link_goal)
    M = T_world_link @ se3.invert(now[fixed_to])
    before = {link: M @ now[link] for link in members}
    pair = seen_pair((shown.scene, shown.take), (asked.scene, asked.take), step, members, before)
    if pair is not None and labelled:
        label = _label(shown, asked, step, members)
        pair = replace(pair, invariance=label) if has_invariant_part(label) else None
    return None if pair is None else SyntheticStep(pair, shown.take, asked.take, step, asked.scene)


def _label(shown: _Instance, asked: _Instance, step: int, members: list[tuple[int, str]]) -> FloatArray:
    """(N,) `StepPair.invariance`, from where the points are on the thing itself; noise beside it has none."""
    cloud, before, now = shown.take.clouds[step], shown.take.poses[step], asked.take.poses[step]
    assert cloud.ids is not None
    found = np.full(len(cloud), np.nan)
    for thing, link in members:
        mine = np.flatnonzero(cloud.ids == shown.scene.stage.links[thing][link])
        own = se3.apply(before[thing, link], shown.surface(thing, link))
        others = se3.apply(now[thing, link], asked.surface(thing, link))
        if len(mine) and len(own) and len(others):
            off, index = nearest(cloud.points[mine], own)
            label = distances(own[index[:, 0]], shown.goal(step), others, asked.goal(step))
            found[mine] = np.where(off[:, 0] < _BESIDE, label, np.nan)
    return found
