"""Something goes wrong once, as it is called; the task can be done all the same, and nothing else changes."""

import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.tasks.disturbances import DISTURBANCES, can_happen
from imop.tasks.env import ImopEnv, make_env, make_task, to_array
from imop.types import Action

RING, DRAWER = "tabletop/ring_on_peg", "tabletop/open_drawer"


def disturbed(name, kind, seed=3):
    env = ImopEnv(make_task(name), disturb=kind)
    env.reset(seed=seed)
    return env


def follow(env, step):
    waypoint = env.task.waypoints(env.world)[step]
    action = Action(waypoint.target(env.world), waypoint.gripper_open, waypoint.allow_collisions)
    return env.step(to_array(action))[-1]


def until_disturbed(env):
    for step in range(len(env.task.waypoints(env.world))):
        before = env.world.pose("ring/body") if env.task.name == RING else None
        info = follow(env, step)
        if info["disturbed"]:
            assert not info["success"]
            return step, before
    raise AssertionError("nothing happened")


def done_from_the_beginning(env):
    """Nothing more goes wrong, and the expert still gets it done."""
    infos = [follow(env, step) for step in range(len(env.task.waypoints(env.world)))]
    return not any(info["disturbed"] for info in infos) and (infos[-1]["success"] or env.wait())


@pytest.mark.parametrize(
    ("kind", "after", "near", "far"),
    [("moved", 0, 0.1, 0.1), ("knocked", 1, 0.1, 0.12), ("missed", 1, 0.03, 0.07)],
)
def test_what_is_to_be_taken_stands_elsewhere_as_it_stood(kind, after, near, far):
    env = disturbed(RING, kind)
    others = [name for name in env.world.instance_names.values() if name not in ("robot", "ring/body")]
    stood = {name: env.world.pose(name) for name in others}
    step, before = until_disturbed(env)
    now = env.world.pose("ring/body")
    assert step == after
    # Things come to rest within millimetres of where they were put.
    assert near - 0.004 < np.linalg.norm((now - before)[:2, 3]) < far + 0.004
    assert abs(now[2, 3] - before[2, 3]) < 0.004 and se3.rotation_distance(now, before) < 0.05
    assert all(se3.near(env.world.pose(name), T, 0.004, 0.05) for name, T in stood.items())
    assert env.world.held == () and np.abs(env.world.data.qvel).max() < 0.1
    assert (env.observation.gripper_opening < 0.01) == (kind != "moved")
    assert done_from_the_beginning(env)


def test_what_was_opened_is_pushed_shut_before_it_counts():
    env = disturbed(DRAWER, "shut")
    step, _ = until_disturbed(env)
    assert step == 2 and env.observation.gripper_opening < 0.01
    assert abs(env.world.joint(env.task.drawer)) < 0.005
    assert done_from_the_beginning(env)


def test_same_seed_same_disturbance():
    poses = []
    for _ in range(2):
        env = disturbed(RING, "moved")
        until_disturbed(env)
        poses.append(env.world.pose("ring/body"))
    np.testing.assert_array_equal(*poses)


def test_until_it_happens_nothing_differs():
    plain, env = make_env(RING), disturbed(RING, "knocked")
    plain.reset(seed=3)
    for each in (plain, env):
        follow(each, 0)
    np.testing.assert_array_equal(plain.world.save_state().physics, env.world.save_state().physics)


def test_what_can_happen_depends_on_what_there_is():
    wanted = {
        RING: {"moved", "knocked", "missed"},
        DRAWER: {"moved", "shut"},
        "tabletop/press_buttons": {"moved"},
        "tabletop/item_in_drawer": set(DISTURBANCES),
        "tabletop/turn_faucet": {"moved", "shut"},
    }
    for name, kinds in wanted.items():
        env = make_env(name)
        env.reset(seed=3)
        assert {kind for kind in DISTURBANCES if can_happen(kind, env.task, env.world)} == kinds, name


def test_an_unknown_disturbance_is_named():
    with pytest.raises(InvalidInput, match="moved, knocked, missed, shut") as error:
        disturbed(RING, "stolen")
    assert error.value.field == "disturb"
