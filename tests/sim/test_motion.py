"""Planned motions: they avoid what they must, fail with a reason, end in bounded time, and repeat."""

import re

import mujoco
import numpy as np
import pytest

from imop.errors import PlanFailed
from imop.geometry import se3
from imop.robots.panda import JOINT_LOWER, JOINT_UPPER, PANDA_HOME_Q, tip_pose
from imop.sim import motion
from imop.sim.arms import PANDA
from imop.sim.gripper import attach
from imop.sim.motion import ACCELERATION, PERIOD, Planner, Trajectory
from imop.sim.world import TABLE_HEIGHT, World, allow_grasp, scene_spec
from imop.types import FloatArray

BOX = mujoco.mjtGeom.mjGEOM_BOX
DOWN = se3.euler(x=np.pi, z=np.pi)


def world_with(*boxes: tuple[tuple[float, ...], tuple[float, ...]]) -> World:
    """A scene with fixed boxes, each given by centre and half sizes."""
    spec = scene_spec()
    for i, (centre, size) in enumerate(boxes):
        body = spec.worldbody.add_body(name=f"box{i}", pos=centre)
        body.add_geom(type=BOX, size=size)
    return World(spec)


def wall_world() -> World:
    """A wall along x between two sides of the workspace, and the arm on one side of it."""
    world = world_with(((0.35, 0.0, TABLE_HEIGHT + 0.2), (0.25, 0.02, 0.2)))
    q = Planner(world).plan(se3.make(DOWN, (0.35, -0.25, 0.85))).positions[-1]
    world.set_robot(q, 1.0)
    return world


def contacts(world: World, q: FloatArray) -> set[frozenset[str]]:
    """Pairs of bodies that really touch on the real model, with the robot on one side."""
    state = world.save_state()
    world.set_robot(q, world.gripper_opening)
    bodies = world.model.geom_bodyid[world.data.contact.geom[world.data.contact.dist < 0]]
    pairs = {frozenset(world.model.body(int(i)).name for i in pair) for pair in bodies}
    world.restore_state(state)
    return {pair for pair in pairs if any(name.startswith("robot/") for name in pair)}


def test_motion_goes_round_a_wall_without_touching_it() -> None:
    world = wall_world()
    goal = se3.make(DOWN, (0.35, 0.25, 0.85))
    trajectory = Planner(world).plan(goal)
    assert not trajectory.straight
    touched = [contacts(world, q) for q in trajectory.positions]
    assert not any(touched)
    # The check itself must be able to find contacts: the motion that ignores collisions has them.
    careless = Planner(world).plan(goal, allow_collisions=True)
    assert any(contacts(world, q) for q in careless.positions)


def test_trajectory_reaches_the_goal_and_keeps_the_limits() -> None:
    world = wall_world()
    goal = se3.make(DOWN, (0.35, 0.25, 0.85))
    t = Planner(world).plan(goal)
    assert np.allclose(t.positions[0], world.robot_q, atol=1e-6)
    assert se3.translation_distance(tip_pose(t.positions[-1]), goal) < 1e-4
    assert se3.rotation_distance(tip_pose(t.positions[-1]), goal) < 1e-3
    assert np.all(t.positions >= JOINT_LOWER - 1e-6) and np.all(t.positions <= JOINT_UPPER + 1e-6)
    assert np.all(np.abs(t.velocities) <= PANDA.velocity * 1.02)
    assert np.all(t.velocities[[0, -1]] == 0)
    steps = np.diff(t.times)
    assert np.all(steps > 0) and steps.max() < PERIOD * 1.01
    assert np.all(np.abs(np.diff(t.velocities, axis=0) / steps[:, None]) <= ACCELERATION * 1.2)


def test_same_seed_gives_the_same_motion_whatever_was_planned_before() -> None:
    world = wall_world()
    goal = se3.make(DOWN, (0.35, 0.25, 0.85))
    first = Planner(world, seed=5).plan(goal)
    other = Planner(world, seed=6).plan(goal)
    again = Planner(world, seed=5).plan(goal)
    assert np.array_equal(first.positions, again.positions)
    assert first.positions.shape != other.positions.shape or np.any(first.positions != other.positions)


def test_planning_leaves_the_world_as_it_is() -> None:
    world = wall_world()
    before, time_before = world.data.qpos.copy(), world.time
    Planner(world).plan(se3.make(DOWN, (0.35, 0.25, 0.85)))
    assert np.array_equal(world.data.qpos, before) and world.time == time_before


def reason(world: World, T: FloatArray, **options: bool) -> str:
    with pytest.raises(PlanFailed) as caught:
        Planner(world).plan(T, **options)
    return caught.value.reason


def test_reasons_of_failure() -> None:
    world = world_with(((0.35, 0.25, TABLE_HEIGHT + 0.1), (0.1, 0.1, 0.1)))
    assert reason(world, se3.make(DOWN, (0.3, 0.0, 0.74))) == "outside_workspace"
    assert reason(world, se3.make(DOWN, (0.77, 0.65, 0.8))) == "unreachable"
    assert reason(world, se3.make(DOWN, (0.35, 0.25, 0.8))) == "goal_in_collision"


def test_a_line_through_an_obstacle_is_refused_and_a_search_is_not() -> None:
    world = wall_world()
    goal = se3.make(DOWN, (0.35, 0.25, 0.85))
    assert reason(world, goal, linear=True) == "no_straight_path"


def test_linear_motion_keeps_the_tip_on_the_line() -> None:
    world = world_with()
    start = world.T_world_gripper
    goal = se3.make(DOWN, (0.35, 0.2, 0.95))
    t = Planner(world).plan(goal, linear=True)
    assert t.straight
    tips = np.stack([tip_pose(q)[:3, 3] for q in t.positions])
    along = (goal - start)[:3, 3] / np.linalg.norm((goal - start)[:3, 3])
    offsets = tips - start[:3, 3]
    aside = offsets - np.outer(offsets @ along, along)
    assert np.linalg.norm(aside, axis=1).max() < 0.002
    assert np.all(np.diff(offsets @ along) > -1e-6)


def caged(p: tuple[float, float, float], lid: bool) -> World:
    """The open gripper in a cage that it does not touch; the lid leaves a hole for the forearm only."""
    a, sides = 0.16, ((1, 0), (-1, 0), (0, 1), (0, -1))
    boxes = [
        ((p[0] + x * a, p[1] + y * a, p[2]), (0.01 if x else a, 0.01 if y else a, 0.15)) for x, y in sides
    ]
    for x, y in sides if lid else ():
        half = (0.05 if x else 0.17, 0.05 if y else 0.17, 0.01)
        boxes.append(((p[0] + x * 0.12, p[1] + y * 0.12, p[2] + 0.16), half))
    tip = se3.make(DOWN, (p[0], p[1], p[2] + 0.03))
    q = Planner(world_with()).plan(tip).positions[-1]
    world = world_with(*boxes)
    world.set_robot(q, 1.0)
    return world


def checks_until_given_up(planner: Planner, T: FloatArray) -> int:
    with pytest.raises(PlanFailed) as caught:
        planner.plan(T)
    assert caught.value.reason == "no_path"
    found = re.search(r"(\d+) collision checks", str(caught.value))
    assert found is not None
    return int(found[1])


def test_a_caged_gripper_is_given_up_after_so_many_checks(monkeypatch: pytest.MonkeyPatch) -> None:
    cage, goal = (0.35, -0.2, 0.92), se3.make(DOWN, (0.3, 0.3, 0.95))
    assert Planner(caged(cage, lid=False)).plan(goal).duration > 0
    monkeypatch.setattr(motion, "_MAX_CHECKS", 2000)
    patient = Planner(caged(cage, lid=True), seconds=np.inf)
    assert 2000 <= checks_until_given_up(patient, goal) < 4000


def test_the_clock_bounds_the_search() -> None:
    goal = se3.make(DOWN, (0.35, 0.25, 0.85))
    assert checks_until_given_up(Planner(wall_world(), seconds=0.0), goal) < 1000
    assert Planner(wall_world()).plan(goal).duration > 0


def test_staying_in_place_is_a_motion() -> None:
    world = world_with()
    t: Trajectory = Planner(world).plan(world.T_world_gripper)
    assert np.abs(t.positions - world.robot_q).max() < 1e-3


def plank_world() -> World:
    """A long plank in the hand, and a post that only the plank would hit on the straight way."""
    spec = scene_spec()
    post = spec.worldbody.add_body(name="post", pos=[0.35, 0.0, TABLE_HEIGHT + 0.1])
    post.add_geom(type=BOX, size=[0.02, 0.02, 0.1])
    plank = spec.worldbody.add_body(name="plank", pos=[0, -0.5, 1])
    plank.add_freejoint()
    plank.add_geom(type=BOX, size=[0.15, 0.015, 0.01])
    allow_grasp(spec, "plank")
    world = World(spec)
    tip = se3.make(DOWN, (0.35 - 0.14, -0.25, 0.9))
    world.set_robot(Planner(world).plan(tip, allow_collisions=True).positions[-1], 1.0)
    world.set_free_pose("plank", se3.make(p=(0.35 - 0.02, -0.25, 0.91)))
    return world


def test_what_the_hand_holds_avoids_obstacles_too() -> None:
    goal = se3.make(DOWN, (0.35 - 0.14, 0.25, 0.9))
    empty = plank_world()
    empty.set_free_pose("plank", se3.make(p=(0.6, -0.5, 0.9)))
    assert Planner(empty).plan(goal).straight
    world = plank_world()
    assert attach(world) == ("plank",)
    T_hand_plank = se3.invert(world.T_world_gripper) @ world.pose("plank")
    trajectory = Planner(world).plan(goal)
    assert not trajectory.straight
    for q in trajectory.positions[::2]:
        world.set_free_pose("plank", tip_pose(q) @ T_hand_plank)
        pairs = world.model.geom_bodyid[world.data.contact.geom[world.data.contact.dist < 0]]
        names = [{world.model.body(int(i)).name for i in pair} for pair in pairs]
        assert {"plank", "post"} not in names


def test_a_line_through_a_singularity_is_no_straight_path():
    """Between its rows of joint positions, too, the tip has to stay on the line."""
    straight = np.linspace(PANDA_HOME_Q, PANDA_HOME_Q + 0.02, 5)
    swinging = straight.copy()
    swinging[2, 0] += 0.2
    assert motion._off_line(straight, PANDA) < 0.002 < motion._off_line(swinging, PANDA)
