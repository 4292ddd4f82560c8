"""One action on the simulated arm: plan, move, then set the gripper."""

import time
from dataclasses import dataclass

import mujoco
import numpy as np

from imop.errors import PlanFailed
from imop.geometry import se3
from imop.sim.gripper import PERIOD_STEPS, OnFrame, set_gripper
from imop.sim.motion import INSIDE, WORKSPACE_LOWER, WORKSPACE_UPPER, Planner, Trajectory
from imop.sim.world import World
from imop.types import Action, FloatArray

_MAX_SETTLE_PERIODS = 10
_ARRIVED, _AT_REST = 0.0005, 0.01


@dataclass(frozen=True)
class Execution:
    """How an action went.

    Attributes:
        planning_seconds: wall time of the planner.
        wall_seconds: wall time of everything.
        simulated_seconds: what the clock of the simulation advanced.
        joint_error: largest distance of a joint from its target after the motion, radians.
        straight: whether the tip was moved on a straight line.
    """

    planning_seconds: float
    wall_seconds: float
    simulated_seconds: float
    joint_error: float
    straight: bool


def execute(
    world: World,
    action: Action,
    linear: bool = False,
    seed: int = 0,
    on_frame: OnFrame | None = None,
    insist: bool = False,
) -> Execution:
    """Reach the action's gripper pose, then open or close.

    Args:
        world: changed in place.
        action: the goal.
        linear: accept only a straight line of the tip.
        seed: of the motion planner.
        on_frame: called with the world every 0.05 simulated seconds of motion.
        insist: see `plan_for`.

    Raises:
        PlanFailed: if no motion was found; the world has not changed then.
    """
    started, simulated = time.monotonic(), world.time
    trajectory = plan_for(world, action.T_world_gripper, action.allow_collisions, linear, seed, insist)
    move(world, trajectory, on_frame)
    error = float(np.abs(world.robot_q - trajectory.positions[-1]).max())
    set_gripper(world, action.gripper_open, on_frame)
    return Execution(
        planning_seconds=trajectory.seconds,
        wall_seconds=time.monotonic() - started,
        simulated_seconds=world.time - simulated,
        joint_error=error,
        straight=trajectory.straight,
    )


def plan_for(
    world: World,
    T_world_gripper: FloatArray,
    allow_collisions: bool = False,
    linear: bool = False,
    seed: int = 0,
    insist: bool = False,
) -> Trajectory:
    """As `Planner.plan`.

    Args:
        world: not changed.
        T_world_gripper: (4, 4) goal of the tip.
        allow_collisions: let the robot touch its surroundings.
        linear: accept only a straight line of the tip.
        seed: of the motion planner.
        insist: take the nearest place in the workspace, and where nothing is found, plan again with
            collisions allowed, as RLBench's policies and RLBench do.

    Raises:
        PlanFailed: if no motion was found.
    """
    planner = Planner(world, seed=seed)
    goal = _within_workspace(T_world_gripper) if insist else T_world_gripper
    try:
        return planner.plan(goal, allow_collisions, linear)
    except PlanFailed:
        if allow_collisions or not insist:
            raise
        return planner.plan(goal, True, linear)


def _within_workspace(T_world_gripper: FloatArray) -> FloatArray:
    p = np.clip(T_world_gripper[:3, 3], WORKSPACE_LOWER + INSIDE, WORKSPACE_UPPER - INSIDE)
    return se3.make(T_world_gripper[:3, :3], p)


def move(world: World, trajectory: Trajectory, on_frame: OnFrame | None = None) -> None:
    """Follow a trajectory from where the arm is, and wait until the arm rests."""
    period = world.model.opt.timestep
    # Each target is held for one time step, so it is the one of the step's middle.
    times = (np.arange(int(np.ceil(trajectory.duration / period))) + 0.5) * period
    q = _interpolate(times, trajectory.times, trajectory.positions)
    dq = _interpolate(times, trajectory.times, trajectory.velocities)
    ddq = np.gradient(dq, period, axis=0) if len(dq) > 1 else np.zeros_like(dq)
    for i in range(len(q)):
        world.data.ctrl[world.arm_ctrl] = _servo_target(world, q[i], dq[i], ddq[i])
        world.step()
        if on_frame is not None and (i + 1) % PERIOD_STEPS == 0:
            on_frame(world)
    world.data.ctrl[world.arm_ctrl] = trajectory.positions[-1]
    _settle(world, trajectory.positions[-1], on_frame)


def _servo_target(world: World, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> FloatArray:
    """Where the servos (J,) must pull so that neither their damping nor the arm's inertia holds it back."""
    m, d = world.model, world.data
    acceleration, torque = np.zeros(m.nv), np.zeros(m.nv)
    acceleration[world.arm_dof] = ddq
    mujoco.mj_mulM(m, d, torque, acceleration)
    resistance = m.dof_damping[world.arm_dof] - m.actuator_biasprm[world.arm_ctrl, 2]
    force = torque[world.arm_dof] + resistance * dq
    target: FloatArray = q + force / m.actuator_gainprm[world.arm_ctrl, 0]
    return target


def _settle(world: World, q_goal: FloatArray, on_frame: OnFrame | None) -> None:
    for _ in range(_MAX_SETTLE_PERIODS):
        world.step(PERIOD_STEPS)
        if on_frame is not None:
            on_frame(world)
        if np.abs(world.robot_q - q_goal).max() < _ARRIVED and np.abs(world.robot_dq).max() < _AT_REST:
            return


def _interpolate(times: FloatArray, known: FloatArray, values: FloatArray) -> FloatArray:
    return np.stack([np.interp(times, known, column) for column in values.T], axis=1)
