"""RLBench's grasp: closing attaches the graspable bodies between the fingers, opening lets them go.

What is not declared graspable (handles, drawers, buttons) is moved by contact and friction alone.
"""

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from imop.geometry import se3
from imop.robots.panda import FINGER_STROKE
from imop.sim.world import ATTACH_VOLUME, GRASP, ROBOT, World

PERIOD_STEPS = 25
"""Physics steps between two looks at the fingers, 0.05 s as RLBench's."""
_MAX_PERIODS = 16
_BLOCKED = 0.0005
_UNMOVED = 1e-6
_SETTLE_PERIODS = 10

OnFrame = Callable[[World], None]


def set_gripper(
    world: World, gripper_open: bool, on_frame: OnFrame | None = None, opening: float | None = None
) -> None:
    """Open or close, and wait until the fingers rest; nothing happens if they were told so last.

    Args:
        world: changed in place.
        gripper_open: the wanted state.
        on_frame: called every 0.05 simulated seconds.
        opening: where the fingers stop, 0 closed .. 1 open; at the end of their way if None. Opening
            further lets go, closing further attaches.
    """
    target = FINGER_STROKE * (float(gripper_open) if opening is None else opening)
    way = target - float(world.data.ctrl[world.finger_ctrl].mean())
    if abs(way) < _UNMOVED:
        return
    if way > 0:
        release(world)
    else:
        attach(world)
    _drive(world, target, on_frame)
    if way > 0:
        for _ in range(_SETTLE_PERIODS):
            _period(world, on_frame)


def between_fingers(world: World) -> tuple[str, ...]:
    """Names of the graspable bodies that reach into the volume between the fingers."""
    return tuple(name for name in world.graspable if _is_between(world, name))


def _is_between(world: World, name: str) -> bool:
    m = world.model
    volume = m.geom(ATTACH_VOLUME).id
    rigid = m.body_weldid == m.body_weldid[m.body(name).id]
    solid = (m.geom_contype != 0) | (m.geom_conaffinity != 0)
    return any(
        mujoco.mj_geomDistance(m, world.data, volume, int(geom), 0.001, None) <= 0
        for geom in np.flatnonzero(rigid[m.geom_bodyid] & solid)
    )


def attach(world: World) -> tuple[str, ...]:
    """Weld what is between the fingers to the hand, each body where it is; returns the names."""
    names = between_fingers(world)
    T_hand_world = se3.invert(world.pose(f"{ROBOT}hand"))
    for name in names:
        weld = world.model.equality(GRASP + name).id
        pose = se3.to_pose7(T_hand_world @ world.pose(name))
        data: Any = world.model.eq_data[weld]
        data[:3] = 0
        data[3:10] = pose[[0, 1, 2, 6, 3, 4, 5]]
        data[10] = 1  # weight of the rotation
        data[11:] = 0  # the compiled pose no longer applies
        world.data.eq_active[weld] = 1
    return names


def release(world: World) -> None:
    """Let go of everything that is attached; poses and velocities stay."""
    for name in world.graspable:
        world.data.eq_active[world.model.equality(GRASP + name).id] = 0


def _drive(world: World, target: float, on_frame: OnFrame | None) -> None:
    """Move the fingers until they arrive or something blocks them."""
    world.data.ctrl[world.finger_ctrl] = target
    before = world.data.qpos[world.finger_qpos].copy()
    for _ in range(_MAX_PERIODS):
        _period(world, on_frame)
        now = world.data.qpos[world.finger_qpos].copy()
        if np.abs(now - before).max() < _BLOCKED:
            return
        before = now


def _period(world: World, on_frame: OnFrame | None) -> None:
    world.step(PERIOD_STEPS)
    if on_frame is not None:
        on_frame(world)
