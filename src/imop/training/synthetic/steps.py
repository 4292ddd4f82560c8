"""Pseudo-steps: what a demonstrator would do with a thing, as gripper poses fixed to a link of it."""

from dataclasses import dataclass, field, replace

import numpy as np

from imop.geometry import se3
from imop.sim.world import TABLE_HEIGHT
from imop.training.synthetic.families.thing import Hold, Moving, from_above
from imop.training.synthetic.stage import Stage, State, Unreachable, opening_for
from imop.types import FloatArray

_HAND = np.array(
    [
        *((x, y, z) for x in (-0.03, 0.03) for y in (-0.1, 0.1) for z in (-0.17, -0.05)),
        *((x, y, 0.008) for x in (-0.01, 0.01) for y in (-0.02, 0.02)),
    ]
)
"""Corners of the hand in the gripper's frame: they may not dip into the table."""
_APART = 0.35
"""How often the fingers open in a keyframe of their own, after the arrival."""


@dataclass(frozen=True, eq=False)
class PseudoStep:
    """One action: the gripper goes to a pose fixed to a link as it is before, then it opens or closes.

    Attributes:
        thing, link: what the pose is fixed to.
        T_link_goal: (4, 4) the gripper after the motion, in the frame of the link before it.
        gripper_open: after the motion.
        opening: of the gripper then, 0 .. 1.
        take: the thing is in the hand from then on.
        carry: a thing that is pushed along though it is not held, and where it is then in the gripper's frame
            (4, 4); or None.
        joint: (name, position) of the thing after the motion.
        loose: the demonstrator goes only about there, up to so many metres off; no pair shows such a step.
        T_reached_recorded: (4, 4) the recorded pose in the frame of the gripper as it is seen afterwards:
            commands, where they are what is recorded, are a little off.
    """

    thing: int
    link: str
    T_link_goal: FloatArray
    gripper_open: bool
    opening: float
    take: bool = False
    carry: tuple[int, FloatArray] | None = None
    joint: tuple[str, float] | None = None
    loose: float = 0.0
    T_reached_recorded: FloatArray = field(default_factory=lambda: np.eye(4))

    def drawn(self, rng: np.random.Generator) -> "PseudoStep":
        """The step as one demonstration does it: a loose one goes somewhere near."""
        if not self.loose:
            return self
        turn, shift = rng.normal(0, 2 * self.loose, 3), rng.uniform(-self.loose, self.loose, 3)
        if self.carry is not None:
            turn, shift = turn * (0, 0, 1), shift * (1, 1, 0)
        off = se3.make(se3.euler(*turn), shift)
        return replace(self, T_link_goal=self.T_link_goal @ off)


@dataclass(frozen=True)
class Lying:
    """A thing lies anywhere on a floor of another one, elsewhere in every scene.

    Attributes:
        below: that one.
        floor: number of the floor.
    """

    below: int
    floor: int


@dataclass(frozen=True, eq=False)
class Before:
    """A thing lies before a goal, somewhere on the way to it.

    Attributes:
        goal: the thing at whose side it ends.
        T_goal_thing: (4, 4) where it ends if it is not turned on the way.
        way: (2,) along which it goes there, unit vector in the goal's frame.
    """

    goal: int
    T_goal_thing: FloatArray
    way: FloatArray


@dataclass(frozen=True, eq=False)
class Script:
    """Steps in order, and how the scene must be before the first one.

    Attributes:
        steps: the actions.
        rests: thing -> rotation (3, 3) in which it lies.
        joints: (thing, joint) -> position.
        resting_on: thing -> (thing below, T_below_thing), for what does not stand on the table.
        starts: numbers of the steps with which something new begins, whatever the gripper did before.
        lying: thing -> where it lies at random, for what lies in or on another thing.
        before: thing -> the goal before which it lies.
    """

    steps: tuple[PseudoStep, ...]
    rests: dict[int, FloatArray]
    joints: dict[tuple[int, str], float]
    resting_on: dict[int, tuple[int, FloatArray]]
    starts: tuple[int, ...] = (0,)
    lying: dict[int, Lying] = field(default_factory=dict)
    before: dict[int, Before] = field(default_factory=dict)

    def then(self, other: "Script") -> "Script":
        """Both, one after the other."""
        return Script(
            self.steps + other.steps,
            other.rests | self.rests,
            other.joints | self.joints,
            other.resting_on | self.resting_on,
            self.starts + tuple(len(self.steps) + start for start in other.starts),
            other.lying | self.lying,
            other.before | self.before,
        )


def perform(stage: Stage, state: State, step: PseudoStep) -> State:
    """The state after a step.

    Raises:
        Unreachable: if the arm cannot, or the hand would dip into the table.
    """
    goal = stage.link_poses(state)[step.thing, step.link] @ step.T_link_goal
    if se3.apply(goal, _HAND)[:, 2].min() < TABLE_HEIGHT:
        raise Unreachable("the hand would dip into the table")
    moved = state.reached(goal)
    if step.carry is not None:
        thing, T_gripper_thing = step.carry
        poses = moved.poses.copy()
        poses[thing] = goal @ T_gripper_thing
        moved = replace(moved, poses=poses)
    joints = dict(state.joints)
    if step.joint is not None:
        joints[step.thing, step.joint[0]] = step.joint[1]
    held = step.thing if step.take else None if step.gripper_open else state.held
    return replace(moved, joints=joints, held=held, gripper_open=step.gripper_open, opening=step.opening)


def back(T: FloatArray, distance: float) -> FloatArray:
    """A gripper pose (4, 4) `distance` metres before one, against its approach."""
    return T @ se3.make(p=(0, 0, -distance))


def pick(rng: np.random.Generator, items: tuple[Hold, ...]) -> Hold:
    """Any one."""
    return items[int(rng.integers(len(items)))]


def raised(R: FloatArray, T_body_gripper: FloatArray, way: FloatArray) -> FloatArray:
    """T_body_gripper after a move by `way` (3,) of a table on which the body lies turned by `R`."""
    return se3.make(p=R.T @ way) @ T_body_gripper


def taken(stage: Stage, thing: int, hold: Hold, rng: np.random.Generator) -> list[PseudoStep]:
    """Approach, close."""
    T, width = hold.T_link_gripper, opening_for(hold.width)
    steps = [PseudoStep(thing, hold.link, back(T, rng.uniform(0.05, 0.12)), True, 1.0)]
    return [*steps, PseudoStep(thing, hold.link, T, False, width, take=hold.link == "body")]


def carry(
    stage: Stage,
    held: int,
    target: int,
    rng: np.random.Generator,
    below: int | None = None,
    into_hole: bool = False,
) -> Script:
    """Take a thing, perhaps from a spot of a third one, and put it on a spot of another, or into a hole."""
    thing = stage.things[held]
    hold = pick(rng, thing.holds)
    R = thing.rests[0] if below is not None else thing.rests[int(rng.integers(len(thing.rests)))]
    resting = {}
    if below is not None:
        resting[held] = (below, on_spot(stage, held, below, rng))
    steps = taken(stage, held, hold, rng)
    T, closed = hold.T_link_gripper, opening_for(hold.width)
    lift = np.array([*rng.uniform(-0.03, 0.03, 2), rng.uniform(0.06, 0.2)])
    if rng.random() < 0.75:
        steps.append(PseudoStep(held, "body", raised(R, T, lift), False, closed))
    placed = on_spot(stage, held, target, rng, into_hole)
    if rng.random() < 0.25:
        aside = rng.uniform(-0.08, 0.08, 2) * (not into_hole)
        placed = se3.make(p=(*aside, rng.uniform(0, 0.1))) @ placed
    goal = placed @ T
    above = se3.make(p=(0, 0, rng.uniform(0.04, 0.12))) @ goal
    if rng.random() < 0.7:
        steps.append(PseudoStep(target, "body", above, False, closed))
    steps += let_go(target, goal, closed, rng)
    if rng.random() < 0.4:
        steps.append(PseudoStep(target, "body", back(goal, rng.uniform(0.05, 0.12)), True, 1.0))
    return Script(tuple(steps), {held: R, target: np.eye(3)}, {}, resting)


def let_go(target: int, goal: FloatArray, closed: float, rng: np.random.Generator) -> list[PseudoStep]:
    """Arrive at T_target_gripper `goal` (4, 4) and open, in one keyframe or in two."""
    opened = PseudoStep(target, "body", goal, True, 1.0)
    return [PseudoStep(target, "body", goal, False, closed), opened] if rng.random() < _APART else [opened]


def on_spot(stage: Stage, held: int, target: int, rng: np.random.Generator, hole: bool = False) -> FloatArray:
    """T_target_held (4, 4) on one of its spots, or in one of its holes, turned at random or not at all."""
    spots = stage.things[target].holes if hole else stage.things[target].spots
    spot = spots[int(rng.integers(len(spots)))]
    yaw = rng.uniform(-np.pi, np.pi) if rng.random() < 0.4 else rng.choice((0, 0.5, 1, 1.5)) * np.pi
    return spot @ se3.make(se3.euler(z=yaw)) @ se3.invert(stage.mount(held))


def use(stage: Stage, tool: int, target: int, rng: np.random.Generator) -> Script:
    """Take a tool, bring its working end to another thing, and make a stroke."""
    thing = stage.things[tool]
    assert thing.tool is not None
    hold = pick(rng, thing.holds)
    R = thing.rests[int(rng.integers(len(thing.rests)))]
    steps = taken(stage, tool, hold, rng)
    T, closed = hold.T_link_gripper, opening_for(hold.width)
    lift = np.array([*rng.uniform(-0.03, 0.03, 2), rng.uniform(0.08, 0.25)])
    steps.append(PseudoStep(tool, "body", raised(R, T, lift), False, closed))
    xy, _ = stage.footprint(target, np.eye(3))
    top = stage.top(target)
    beside = rng.random() < 0.5
    at = se3.make(p=(0, 0, top + rng.uniform(0.0, 0.04)))
    down = se3.euler(x=np.pi)
    if beside:
        angle = rng.uniform(-np.pi, np.pi)
        far = float(np.abs(xy @ (np.cos(angle), np.sin(angle))).max()) + 0.02
        at = se3.make(se3.euler(z=angle), (far * np.cos(angle), far * np.sin(angle), 0.5 * top))
        down = se3.euler(y=-np.pi / 2)
    T_target_tip = at @ se3.make(down @ se3.euler(z=rng.uniform(-np.pi, np.pi)))
    T_tool_tip = thing.tool
    goal = T_target_tip @ se3.invert(T_tool_tip) @ T
    steps.append(PseudoStep(target, "body", goal, False, closed))
    way = rng.uniform(-0.06, 0.06, 3) if not beside else -0.1 * at[:3, 0] * rng.uniform(0.3, 1.0)
    steps.append(PseudoStep(target, "body", se3.make(p=way) @ goal, False, closed))
    return Script(tuple(steps), {tool: R, target: np.eye(3)}, {}, {})


def operate(stage: Stage, thing: int, moving: Moving, rng: np.random.Generator) -> Script:
    """Pull, turn, push or press what is on a joint."""
    start, end = moving.positions
    part = rng.uniform(0.5, 1.0)
    end = start + part * (end - start)
    hold = moving.hold
    before, after = (stage.link_in_body(thing, moving.joint, p) for p in (start, end))
    T = hold.T_link_gripper
    open_, width = (False, 0.0) if moving.push else (True, 1.0)
    steps = [PseudoStep(thing, hold.link, back(T, rng.uniform(0.04, 0.12)), open_, width)]
    if moving.push:
        if rng.random() < 0.3:
            steps.append(PseudoStep(thing, hold.link, T, False, 0.0))
    else:
        steps.append(PseudoStep(thing, hold.link, T, False, opening_for(hold.width)))
    goal = se3.invert(before) @ after @ T
    let_go = not moving.push and rng.random() < 0.5
    opening = 1.0 if let_go else opening_for(hold.width)
    steps.append(PseudoStep(thing, hold.link, goal, let_go, opening, joint=(moving.joint, end)))
    if let_go or (moving.push and rng.random() < 0.5):
        steps.append(PseudoStep(thing, hold.link, back(T, rng.uniform(0.05, 0.1)), let_go, opening))
    joints = {(thing, moving.joint): start}
    return Script(tuple(steps), {thing: np.eye(3)}, joints, {})


def press(stage: Stage, thing: int, rng: np.random.Generator) -> Script:
    """Touch a thing with closed fingers."""
    pokes = stage.things[thing].pokes
    if pokes:
        T = pick(rng, pokes).T_link_gripper
    else:
        T = from_above((0, 0, stage.top(thing)), rng.uniform(-np.pi, np.pi), rng.uniform(-0.3, 0.3))
    steps = [PseudoStep(thing, "body", back(T, rng.uniform(0.04, 0.12)), False, 0.0)]
    steps.append(PseudoStep(thing, "body", T, False, 0.0))
    return Script(tuple(steps), {thing: np.eye(3)}, {}, {})


def push(stage: Stage, thing: int, rng: np.random.Generator) -> Script:
    """Shove a thing over the table with closed fingers."""
    xy, _ = stage.footprint(thing, np.eye(3))
    angle = rng.uniform(-np.pi, np.pi)
    way = np.array([np.cos(angle), np.sin(angle), 0.0])
    bottom = stage.bottom(thing)
    low = bottom + min(0.02, 0.5 * (stage.top(thing) - bottom))
    touch = -(float((xy @ -way[:2]).max()) + 0.012) * way + np.array([0, 0, low])
    yaw = rng.uniform(-np.pi, np.pi)
    T = from_above((touch[0], touch[1], touch[2]), yaw)
    before = se3.make(p=-rng.uniform(0.02, 0.06) * way) @ T
    steps = [PseudoStep(thing, "body", se3.make(p=(0, 0, 0.08)) @ before, False, 0.0)]
    if rng.random() < 0.5:
        steps.append(PseudoStep(thing, "body", before, False, 0.0))
    steps.append(PseudoStep(thing, "body", T, False, 0.0))
    goal = se3.make(p=rng.uniform(0.04, 0.12) * way) @ T
    steps.append(PseudoStep(thing, "body", goal, False, 0.0, carry=(thing, se3.invert(T))))
    return Script(tuple(steps), {thing: np.eye(3)}, {}, {})
