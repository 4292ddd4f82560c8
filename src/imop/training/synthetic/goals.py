"""Pseudo-steps whose goal is what matters: something is kept at it, pushed to it, or was in a box before."""

from dataclasses import replace

import numpy as np

from imop.geometry import se3
from imop.training.synthetic.families.thing import from_above
from imop.training.synthetic.stage import Stage, opening_for
from imop.training.synthetic.steps import (
    Before,
    Lying,
    PseudoStep,
    Script,
    back,
    carry,
    on_spot,
    pick,
    raised,
    taken,
)
from imop.types import FloatArray

_ABOUT = (0.01, 0.04)
"""How loosely one pauses before a goal, metres."""


def keep(stage: Stage, held: int, target: int, rng: np.random.Generator) -> Script:
    """Take a thing, bring it to another one and keep it in the hand: inserted, pushed under, turned to it."""
    thing = stage.things[held]
    hold = pick(rng, thing.holds)
    R = thing.rests[int(rng.integers(len(thing.rests)))]
    T, closed = hold.T_link_gripper, opening_for(hold.width)
    steps = taken(stage, held, hold, rng)
    lift = np.array([*rng.uniform(-0.04, 0.04, 2), rng.uniform(0.06, 0.2)])
    if rng.random() < 0.6:
        steps.append(PseudoStep(held, "body", raised(R, T, lift), False, closed, loose=_loosely(rng)))
    T_target_held, out = _kept_at(stage, held, target, rng)
    goal = T_target_held @ T
    if rng.random() < 0.5:
        before = se3.make(p=rng.uniform(0.04, 0.12) * out) @ goal
        steps.append(PseudoStep(target, "body", before, False, closed, loose=rng.uniform(*_ABOUT)))
    steps.append(PseudoStep(target, "body", goal, False, closed))
    style = rng.random()
    if style < 0.3:
        further = se3.make(p=-rng.uniform(0.015, 0.05) * out) @ goal
        steps.append(PseudoStep(target, "body", further, False, closed))
    elif style < 0.5:
        turn = se3.make(se3.euler(z=rng.choice((-1.0, 1.0)) * rng.uniform(0.4, 1.6)))
        turned = T_target_held @ turn @ se3.invert(T_target_held) @ goal
        steps.append(PseudoStep(target, "body", turned, False, closed))
    return Script(tuple(steps), {held: R, target: np.eye(3)}, {}, {})


def _loosely(rng: np.random.Generator) -> float:
    """Whether, and how loosely, a lift is done."""
    return float(rng.uniform(*_ABOUT)) if rng.random() < 0.5 else 0.0


def _kept_at(stage: Stage, held: int, target: int, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """T_target_held (4, 4) at a goal on or beside the target, and the direction (3,) from which it comes."""
    other, tool = stage.things[target], stage.things[held].tool
    up, style, yaw = np.array([0.0, 0.0, 1.0]), rng.random(), rng.choice((-1, -0.5, 0, 0.5)) * np.pi
    if rng.random() < 0.3:
        yaw = rng.uniform(-np.pi, np.pi)
    turned = se3.make(se3.euler(z=yaw))
    if other.keeps and style < 0.8:
        keep_ = other.keeps[int(rng.integers(len(other.keeps)))]
        return keep_ @ turned @ se3.invert(stage.mount(held)), keep_[:3, 0]
    if tool is not None and style < 0.9:
        spot = se3.make(p=(0, 0, stage.top(target) + rng.uniform(0.0, 0.03)))
        return spot @ turned @ se3.make(se3.euler(x=np.pi)) @ se3.invert(tool), up
    if len(other.spots) and style < 0.4:
        return on_spot(stage, held, target, rng), up
    angle, far = rng.uniform(-np.pi, np.pi), rng.uniform(0.0, 0.1)
    out = np.array([np.cos(angle), np.sin(angle), 0.0])
    edges = [
        float((stage.footprint(i, se3.euler(z=-angle if i == target else 0.0))[0][:, 0]).max())
        for i in (target, held)
    ]
    high = stage.bottom(target) + rng.uniform(0.01, 0.08)
    beside = se3.make(se3.euler(z=angle), (sum(edges) + far) * out + (0, 0, high))
    return beside @ turned @ se3.invert(stage.mount(held)), out


def unpack(
    stage: Stage, held: int, below: int, target: int, others: tuple[int, ...], rng: np.random.Generator
) -> Script:
    """Take a thing that lies anywhere in or on another one and put it on a third, or keep it there.

    Args:
        stage: the things.
        held: the one.
        below: in or on which it lies.
        target: where it goes.
        others: what else lies there.
        rng: how.
    """
    found = (keep if rng.random() < 0.3 else carry)(stage, held, target, rng)
    floors = len(stage.things[below].floors)
    lying = {thing: Lying(below, int(rng.integers(floors))) for thing in (held, *others)}
    rests = {held: np.eye(3), below: np.eye(3), **dict.fromkeys(others, np.eye(3))}
    return Script(found.steps, rests | {target: np.eye(3)}, {}, {}, lying=lying)


def shove(stage: Stage, thing: int, goal: int, rng: np.random.Generator) -> Script:
    """Push a thing over the table with closed fingers until it is at a goal, which decides way and end."""
    T_goal_end = _end(stage, goal, rng)
    way, angle = T_goal_end[:2, 0], rng.uniform(-np.pi, np.pi)
    # How the thing is turned when it arrives: its own direction `angle` along the way.
    xy, _ = stage.footprint(thing, se3.euler(z=-angle))
    behind, ahead = float(-xy[:, 0].min()) + 0.012, float(xy[:, 0].max())
    middle = np.array([0.0, float(xy[:, 1].min() + xy[:, 1].max()) / 2])
    bottom = stage.bottom(thing)
    low = bottom + min(0.02, 0.5 * (stage.top(thing) - bottom))
    T_thing_way = se3.make(se3.euler(z=angle))
    T = T_thing_way @ from_above(
        (-behind, middle[1], low), rng.choice((0.0, 0.5)) * np.pi + rng.normal(0, 0.2)
    )
    T_goal_thing = T_goal_end @ se3.make(p=(-ahead, -middle[1], -bottom)) @ se3.invert(T_thing_way)
    away = T_thing_way @ se3.make(p=(-rng.uniform(0.02, 0.05), 0, 0)) @ se3.invert(T_thing_way) @ T
    steps = [PseudoStep(thing, "body", se3.make(p=(0, 0, 0.08)) @ away, False, 0.0)]
    style = rng.random()
    if style < 0.7:
        steps.append(PseudoStep(thing, "body", away, False, 0.0))
    if style > 0.4:
        steps.append(PseudoStep(thing, "body", T, False, 0.0))
    if len(stage.things[thing].symmetry) > 1:
        # Only the goal tells on which of its equal sides it is touched: no pair of the thing alone can.
        steps = [replace(step, loose=0.001) for step in steps]
    arrived, T_gripper_thing = T_goal_thing @ T, se3.invert(T)
    if rng.random() < 0.35:
        halfway = se3.make(p=(*(-rng.uniform(0.03, 0.06) * way), 0)) @ arrived
        loose = _loosely(rng) / 2
        steps.append(
            PseudoStep(goal, "body", halfway, False, 0.0, carry=(thing, T_gripper_thing), loose=loose)
        )
    steps.append(PseudoStep(goal, "body", arrived, False, 0.0, carry=(thing, T_gripper_thing)))
    if rng.random() < 0.3:
        steps.append(PseudoStep(goal, "body", back(arrived, rng.uniform(0.05, 0.1)), False, 0.0))
    rests = {thing: np.eye(3), goal: np.eye(3)}
    return Script(tuple(steps), rests, {}, {}, before={thing: Before(goal, T_goal_thing, way)})


def _end(stage: Stage, goal: int, rng: np.random.Generator) -> FloatArray:
    """T_goal_end (4, 4) on the table, +x along the push: a goal of the thing, or any side if it has none."""
    goals, angle = stage.things[goal].goals, rng.uniform(-np.pi, np.pi)
    if goals:
        return goals[int(rng.integers(len(goals)))]
    xy, _ = stage.footprint(goal, se3.euler(z=-angle))
    side = se3.make(p=(float(xy[:, 0].min()), 0.0, stage.bottom(goal)))
    return se3.make(se3.euler(z=angle)) @ side
