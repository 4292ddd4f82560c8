"""One action on the simulated arm: plan, move, then set the gripper."""

import time
from dataclasses import dataclass

import numpy as np

from imop.sim.gripper import PERIOD_STEPS, OnFrame, set_gripper
from imop.sim.motion import Planner, Trajectory
from imop.sim.world import World
from imop.types import Action, FloatArray

_CONTROL_STEPS = 2
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
    world: World, action: Action, linear: bool = False, seed: int = 0, on_frame: OnFrame | None = None
) -> Execution:
    """Reach the action's gripper pose, then open or close.

    Args:
        world: changed in place.
        action: the goal.
        linear: accept only a straight line of the tip.
        seed: of the motion planner.
        on_frame: called with the world every 0.05 simulated seconds.

    Raises:
        PlanFailed: if no motion was found; the world has not changed then.
    """
    started, simulated = time.monotonic(), world.time
    trajectory = Planner(world, seed=seed).plan(action.T_world_gripper, action.allow_collisions, linear)
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


def move(world: World, trajectory: Trajectory, on_frame: OnFrame | None = None) -> None:
    """Follow a trajectory from where the arm is, and wait until the arm rests."""
    lead = _velocity_lead(world)
    dt = world.model.opt.timestep
    times = np.arange(1, int(np.ceil(trajectory.duration / dt / _CONTROL_STEPS)) + 1) * dt * _CONTROL_STEPS
    q = _interpolate(times, trajectory.times, trajectory.positions)
    dq = _interpolate(times, trajectory.times, trajectory.velocities)
    dq[-1] = 0.0
    for i, target in enumerate(q + lead * dq):
        world.data.ctrl[world.arm_ctrl] = target
        world.step(_CONTROL_STEPS)
        if on_frame is not None and i % (PERIOD_STEPS // _CONTROL_STEPS) == 0:
            on_frame(world)
    _settle(world, trajectory.positions[-1], on_frame)


def _settle(world: World, q_goal: FloatArray, on_frame: OnFrame | None) -> None:
    for _ in range(_MAX_SETTLE_PERIODS):
        world.step(PERIOD_STEPS)
        if on_frame is not None:
            on_frame(world)
        if np.abs(world.robot_q - q_goal).max() < _ARRIVED and np.abs(world.robot_dq).max() < _AT_REST:
            return


def _velocity_lead(world: World) -> FloatArray:
    """Seconds (7,) by which a servo's target must lead for its damping not to hold the arm back."""
    m = world.model
    stiffness = m.actuator_gainprm[world.arm_ctrl, 0]
    resistance = m.dof_damping[world.arm_dof] - m.actuator_biasprm[world.arm_ctrl, 2]
    lead: FloatArray = resistance / stiffness
    return lead


def _interpolate(times: FloatArray, known: FloatArray, values: FloatArray) -> FloatArray:
    return np.stack([np.interp(times, known, column) for column in values.T], axis=1)
