"""Motions of the arm: inverse kinematics, a straight line where it is free, else RRT-Connect, then timing.

Every search is bounded by a number of collision checks, so that a seed gives the same motion on any machine,
and by a wall clock in case a machine is very slow.
"""

import logging
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import toppra
import toppra.algorithm
import toppra.constraint
from ompl import base, geometric, util

from imop.errors import PlanFailed
from imop.geometry import se3
from imop.sim.arms import Arm
from imop.sim.collision import CollisionChecker, densify
from imop.sim.kinematics import line
from imop.sim.world import World
from imop.types import FloatArray, as_pose

WORKSPACE_LOWER = np.array([-0.275, -0.655, 0.752])
WORKSPACE_UPPER = np.array([0.775, 0.655, 1.752])
"""Where RLBench accepts targets, metres, world frame."""
INSIDE = 0.0002
"""What is clipped to the workspace ends so far inside of its bounds, metres."""

ACCELERATION = 5.0
"""Of every joint, radians per second squared."""
PERIOD = 0.01
"""Seconds between samples of a trajectory."""

_LINE_STEP, _LINE_TURN = 0.01, 0.05
_MAX_JOINT_STEP = 0.25
_OFF_LINE = 0.002
_MAX_CHECKS = 30_000
_MAX_GOALS = 8
_GOAL_DISTANCE = 0.3
_ATTEMPTS = 3
_SPLINE_STEPS = (0.08, 0.02)

util.noOutputHandler()
logging.getLogger("toppra").setLevel(logging.ERROR)


TimedPath = tuple[FloatArray, FloatArray, FloatArray]
"""Times (n,), positions (n, J), velocities (n, J)."""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A timed motion of the arm.

    Attributes:
        times: (n,) seconds from 0.
        positions: (n, J) radians.
        velocities: (n, J) radians per second; zero at both ends.
        straight: whether the tip moves on a straight line.
        seconds: wall time that planning took.
    """

    times: FloatArray
    positions: FloatArray
    velocities: FloatArray
    straight: bool
    seconds: float

    @property
    def duration(self) -> float:
        """Seconds of motion."""
        return float(self.times[-1])


class Planner:
    """Plans motions from the world's current state; the world is not changed.

    Args:
        world: the scene.
        seed: of the random search; equal worlds and seeds give equal motions.
        seconds: wall-clock bound of one plan, which is normally never reached.
    """

    def __init__(self, world: World, seed: int = 0, seconds: float = 10.0):
        self._world, self._seed, self._seconds = world, seed, seconds
        self._arm = world.arm

    def plan(
        self, T_world_gripper: FloatArray, allow_collisions: bool = False, linear: bool = False
    ) -> Trajectory:
        """Find a motion that brings the tip to a pose.

        Args:
            T_world_gripper: (4, 4) goal of the tip.
            allow_collisions: let the robot touch its surroundings (never itself).
            linear: accept only a straight line of the tip.

        Raises:
            InvalidInput: if the goal is not a rigid transformation.
            PlanFailed: if there is no motion; `reason` says why.
        """
        started = time.monotonic()
        T = as_pose("T_world_gripper", T_world_gripper)
        if np.any(T[:3, 3] <= WORKSPACE_LOWER) or np.any(T[:3, 3] >= WORKSPACE_UPPER):
            raise PlanFailed("outside_workspace", f"{np.round(T[:3, 3], 3).tolist()} m")
        q_start = np.clip(self._world.robot_q, self._arm.lower, self._arm.upper)
        goals = self._arm.kinematics.inverse(T, q_start)
        if len(goals) == 0:
            raise PlanFailed("unreachable", "no joint configuration has this tip pose")
        checker = CollisionChecker(self._world, allow_collisions)
        checker.expect_goal(goals[0])
        path = self._straight(T, q_start, checker)
        if path is not None:
            timed = _timed(path, checker.after_search(), self._arm)
        elif linear:
            raise PlanFailed("no_straight_path")
        else:
            timed = self._search(q_start, _valid_goals(goals, checker), checker, started + self._seconds)
        return Trajectory(*timed, straight=path is not None, seconds=time.monotonic() - started)

    def _straight(self, T: FloatArray, q_start: FloatArray, checker: CollisionChecker) -> FloatArray | None:
        T_start = self._world.T_world_gripper
        distance, turn = se3.translation_distance(T_start, T), se3.rotation_distance(T_start, T)
        steps = max(1, int(np.ceil(distance / _LINE_STEP)), int(np.ceil(turn / _LINE_TURN)))
        rows = self._arm.kinematics.follow(line(T_start, T, steps), q_start)
        if rows is None:
            return None
        path = np.concatenate([q_start[None], rows])
        if np.abs(np.diff(path, axis=0)).max() > _MAX_JOINT_STEP or _off_line(path, self._arm) > _OFF_LINE:
            return None
        return path if checker.valid_motion(path) else None

    def _search(
        self, q_start: FloatArray, goals: FloatArray, checker: CollisionChecker, deadline: float
    ) -> TimedPath:
        if len(goals) == 0:
            raise PlanFailed("goal_in_collision", "every configuration with this tip pose touches something")
        for goal in goals:
            direct = np.stack([q_start, goal])
            if checker.valid_motion(direct):
                return _timed(direct, checker.after_search(), self._arm)
        failure = PlanFailed("no_path")
        for attempt in range(_ATTEMPTS):
            seed = _ATTEMPTS * self._seed + attempt
            path = _rrt_connect(q_start, goals, checker, self._arm, seed, deadline)
            if path is None:
                raise PlanFailed("no_path", f"none found with {checker.checks} collision checks")
            try:
                return _timed(path, checker.after_search(), self._arm)
            except PlanFailed as error:
                failure = error
        raise failure


def _valid_goals(goals: FloatArray, checker: CollisionChecker) -> FloatArray:
    """Up to `_MAX_GOALS` collision-free rows of `goals`, nearest first and unlike each other."""
    chosen: list[FloatArray] = []
    for goal in goals:
        new = all(np.abs(goal - other).max() > _GOAL_DISTANCE for other in chosen)
        if new and checker.valid(goal):
            chosen.append(goal)
            if len(chosen) == _MAX_GOALS:
                break
    return np.stack(chosen) if chosen else np.empty((0, goals.shape[1]))


def _rrt_connect(
    q_start: FloatArray,
    goals: FloatArray,
    checker: CollisionChecker,
    arm: Arm,
    seed: int,
    deadline: float,
) -> FloatArray | None:
    util.RNG.setSeed(seed + 1)  # 0 means a random seed
    n = len(q_start)
    space = base.RealVectorStateSpace(n)
    bounds = base.RealVectorBounds(n)
    for i in range(n):
        bounds.setLow(i, float(arm.lower[i]))
        bounds.setHigh(i, float(arm.upper[i]))
    space.setBounds(bounds)
    information = base.SpaceInformation(space)
    information.setStateValidityChecker(lambda state: checker.valid(_row(state, n)))
    information.setStateValidityCheckingResolution(0.003)
    information.setup()
    problem = base.ProblemDefinition(information)
    problem.addStartState(_state(space, q_start))
    goal_states = base.GoalStates(information)
    for goal in goals:
        goal_states.addState(_state(space, goal))
    problem.setGoal(goal_states)
    planner = geometric.RRTConnect(information)
    planner.setProblemDefinition(problem)
    planner.setup()
    last = checker.checks + _MAX_CHECKS

    def exhausted() -> bool:
        return checker.checks >= last or time.monotonic() > deadline

    planner.solve(base.PlannerTerminationCondition(exhausted))
    if not problem.hasExactSolution():
        return None
    path = problem.getSolutionPath()
    simplifier = geometric.PathSimplifier(information)
    simplifier.reduceVertices(path, 40, 20)
    simplifier.partialShortcutPath(path, 60, 30)
    simplifier.collapseCloseVertices(path, 20, 10)
    return np.stack([_row(state, n) for state in path.getStates()])


def _state(space: Any, q: FloatArray) -> Any:
    state = space.allocState()
    for i, position in enumerate(q):
        state[i] = float(position)
    return state


def _row(state: Any, n: int) -> FloatArray:
    return np.array([state[i] for i in range(n)])


def _off_line(path: FloatArray, arm: Arm) -> float:
    """How far the tip leaves the straight line halfway between two rows of joint positions, at most, metres.

    Near a singularity the rows lie on the line although the arm swings wide between them.
    """
    p_rows = np.stack([arm.kinematics.tip_pose(q)[:3, 3] for q in path])
    p_between = np.stack([arm.kinematics.tip_pose(q)[:3, 3] for q in (path[1:] + path[:-1]) / 2])
    return float(np.linalg.norm(p_between - (p_rows[1:] + p_rows[:-1]) / 2, axis=1).max())


def _timed(path: FloatArray, checker: CollisionChecker, arm: Arm) -> TimedPath:
    """Times, positions and velocities along `path`, smoothed where that stays valid.

    Raises:
        PlanFailed: "no_timing" if no velocity profile exists, "in_motion_collision" if none stays valid.
    """
    if len(path) == 2 and np.abs(path[1] - path[0]).max() < 1e-4:
        return np.array([0.0, PERIOD]), path, np.zeros_like(path)
    for step in _SPLINE_STEPS:
        timed = _profile(densify(path, step), arm.velocity)
        if checker.valid_motion(timed[1][::2]):
            return timed
    # Rounded corners touch something: stop at each corner instead.
    timed = _joined([_profile(path[i : i + 2], arm.velocity) for i in range(len(path) - 1)])
    if not checker.valid_motion(timed[1]):
        raise PlanFailed("in_motion_collision", "the timed motion leaves the free path")
    return timed


def _profile(rows: FloatArray, velocity: FloatArray) -> TimedPath:
    lengths = np.linalg.norm(np.diff(rows, axis=0), axis=1)
    rows = rows[np.concatenate([[True], lengths > 1e-7])]
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(rows, axis=0), axis=1))])
    spline = toppra.SplineInterpolator(s, rows, bc_type="natural" if len(rows) > 2 else "not-a-knot")
    n = len(velocity)
    limits = [
        toppra.constraint.JointVelocityConstraint(np.stack([-velocity, velocity], axis=1)),
        toppra.constraint.JointAccelerationConstraint(np.tile((-ACCELERATION, ACCELERATION), (n, 1))),
    ]
    solver = toppra.algorithm.TOPPRA(limits, spline, parametrizer="ParametrizeConstAccel")
    timed = solver.compute_trajectory(0.0, 0.0)
    if timed is None:
        raise PlanFailed("no_timing")
    samples = max(2, int(np.ceil(timed.duration / PERIOD)) + 1)
    times = np.linspace(0.0, timed.duration, samples)
    velocities = timed(times, 1)
    velocities[[0, -1]] = 0.0
    return times, timed(times), velocities


def _joined(parts: list[TimedPath]) -> TimedPath:
    offsets = np.concatenate([[0.0], np.cumsum([part[0][-1] for part in parts])])
    times = [part[0][i > 0 :] + offset for i, (part, offset) in enumerate(zip(parts, offsets, strict=False))]
    rest = [[part[k][i > 0 :] for i, part in enumerate(parts)] for k in (1, 2)]
    return np.concatenate(times), np.concatenate(rest[0]), np.concatenate(rest[1])
